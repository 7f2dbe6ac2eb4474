"""Jobs for the tests of the pool, importable by its processes."""

import ctypes
import os
import signal
import time
from pathlib import Path


def process_id(number: int) -> tuple[int, int]:
    """Returns ``number``, and in which process."""
    return number, os.getpid()


def end_by_force():
    """Ends the process as the kernel does when there is no memory left."""
    os.kill(os.getpid(), signal.SIGKILL)


def refuse():
    """Raises an exception that a pipe cannot carry."""
    raise UnportableError("one", "two")


def hang(note: Path):
    """Notes the number of its process in the folder ``note``, then does not end for a long time."""
    (note / str(os.getpid())).touch()
    time.sleep(600.0)


def hang_without_kernel_watch(note: Path):
    """The same where the kernel does not tell processes of the end of their parent."""
    ctypes.CDLL(None).prctl(1, 0)
    hang(note)


class UnportableError(Exception):
    """Pickles, but does not come out again: its arguments are not those of its constructor."""

    def __init__(self, first, second):
        super().__init__(f"{first} and {second}")
