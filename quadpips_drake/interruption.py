"""Ending early: Ctrl-C, and the signals of schedulers, ``timeout`` and closing terminals, which count as one Ctrl-C.

The first signal raises KeyboardInterrupt wherever the program is (for SIGTERM and SIGHUP the subclass Terminated, so that
the exit status can tell them apart). Those who are interrupted then write what they have, which takes seconds: for
PATIENCE seconds after it further signals only say so. After that the next signal ends whatever still goes on.
"""

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

PATIENCE = 20.0
"""How long after a signal, and how long while files are written, further ones are ignored [s]."""
_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_STILL_WRITING = "what was computed is being written (a further signal counts after {:.0f} s)\n"


class Terminated(KeyboardInterrupt):
    """A signal other than that of Ctrl-C asks the program to end."""

    def __init__(self, number: int):
        """Args: of the signal."""
        super().__init__(signal.Signals(number).name)
        self.number = number


class _Interruption:
    """What has happened so far in this process."""

    def __init__(self):
        self.quiet_until = -float("inf")
        """Signals before this time of the monotonic clock are not raised [s]."""
        self.raised: KeyboardInterrupt | None = None
        """What the first signal raised."""

    def handle(self, number: int, frame) -> None:
        """The handler: raises, or says that there is no need to ask twice."""
        now = time.monotonic()
        if now < self.quiet_until:
            # Not by print: the signal may have come in the middle of another one.
            os.write(2, _STILL_WRITING.format(self.quiet_until - now).encode())
            return
        self.quiet_until = now + PATIENCE
        self.raised = KeyboardInterrupt() if number == signal.SIGINT else Terminated(number)
        raise self.raised


_state = _Interruption()


@contextmanager
def _handlers() -> Iterator[None]:
    """Lets ``_state`` handle the signals, except those that this process was started to ignore (nohup, background jobs).

    Signals reach only the main thread; in others nothing is changed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    ours = [number for number, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    for number in ours:
        signal.signal(number, _state.handle)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, before[number])


@contextmanager
def interruptible() -> Iterator[None]:
    """Makes SIGTERM and SIGHUP end the block like Ctrl-C; see the head of this file."""
    with _handlers():
        try:
            yield
        finally:
            _state.quiet_until, _state.raised = -float("inf"), None


def check() -> None:
    """Raises the interruption again if there was one: what is raised in a destructor or a foreign callback may get lost."""
    if _state.raised is not None:
        raise _state.raised


@contextmanager
def undisturbed() -> Iterator[None]:
    """Lets the block, which writes what was computed, come to its end: signals only count after it, or after PATIENCE."""
    with _handlers():
        quiet_before = _state.quiet_until
        _state.quiet_until = max(quiet_before, time.monotonic() + PATIENCE)
        try:
            yield
        finally:
            _state.quiet_until = quiet_before


def exit_status(error: BaseException) -> int:
    """The exit status for an interruption, as shells count it: 128 and the number of the signal (Ctrl-C: 130)."""
    return 128 + (error.number if isinstance(error, Terminated) else signal.SIGINT)
