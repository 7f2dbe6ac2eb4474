"""Computing beside the simulation what is due only later: the second core, without another result.

A stage with a latency L that begins an update at t shows its result after t + L. Until then nobody can tell whether it has
been computed already, so that it may be computed by another thread meanwhile, from inputs and memory that never change. Who
needs it, waits for it. Results, their order and their times are those of a single thread, to the bit, however fast either
thread is. What makes this quick is that kernels and libraries do not hold Python's lock while they compute, and neither does
Drake between two calls of Python systems.
"""

import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from pydrake.systems.framework import Diagram, System

_SWITCH_INTERVAL = 5e-4
"""After so long a thread that runs Python code lets another one go on [s]; Python's own 5 ms are many steps of physics."""


class Deferred:
    """A value that is being computed, or has been; it never becomes another, so a copy is the original."""

    def __init__(self, future: Future):
        self._future = future

    @property
    def value(self) -> Any:
        """The value, as soon as it is there; what went wrong while it was computed is raised here."""
        return self._future.result()

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self


def value_of(memory: Any) -> Any:
    """What ``memory`` stands for: the value of a Deferred, everything else itself."""
    return memory.value if isinstance(memory, Deferred) else memory


class Background:
    """Threads that compute late results, one for each stage, so that no result has to wait for that of another stage."""

    def __init__(self):
        self._threads: dict[Any, ThreadPoolExecutor] = {}
        self._interval_before = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_INTERVAL)

    def compute(self, owner: Any, function: Callable, memory: Any, *args) -> Deferred:
        """Begins ``function(memory, *args)``, after what was begun for the same ``owner`` before; see ``value_of``."""
        if owner not in self._threads:
            self._threads[owner] = ThreadPoolExecutor(1, thread_name_prefix=type(owner).__name__)
        return Deferred(self._threads[owner].submit(lambda: function(value_of(memory), *args)))

    def close(self) -> None:
        """Ends the threads, each after what it is computing."""
        for thread in self._threads.values():
            thread.shutdown(wait=True, cancel_futures=True)
        self._threads.clear()
        sys.setswitchinterval(self._interval_before)


def stages_of(system: System, kind: type) -> list:
    """All systems of the class ``kind`` in a diagram, at any depth."""
    if isinstance(system, Diagram):
        return [found for part in system.GetSystems() for found in stages_of(part, kind)]
    return [system] if isinstance(system, kind) else []
