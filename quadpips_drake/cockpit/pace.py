"""How fast simulated time goes by: at most ``speed`` times as fast as a clock."""

import time
from collections import deque

_WINDOW = 2.0
"""Time over which the real-time factor is measured [s]."""
_BEHIND = 0.2
"""A simulation that is later than this by the clock [s] does not hurry to catch up."""


class Pace:
    """Tells how long to wait before the next step."""

    def __init__(self, speed: float | None):
        self.speed = speed
        """Simulated per real second; None: as fast as possible."""
        self._anchor: tuple[float, float] | None = None
        """A simulated time [s] and when it was there by the clock [s]."""
        self._marks: deque[tuple[float, float]] = deque()

    def set(self, speed: float | None) -> None:
        """Another speed from now on."""
        self.speed = speed
        self.rest()

    def rest(self) -> None:
        """Time has stood still: there is nothing to catch up with, and no factor."""
        self._anchor = None
        self._marks.clear()

    def delay(self, sim_time: float) -> float:
        """How long to wait [s] before the simulation goes on from ``sim_time`` [s]."""
        now = time.monotonic()
        self._marks.append((sim_time, now))
        while now - self._marks[0][1] > _WINDOW:
            self._marks.popleft()
        if self.speed is None:
            return 0.0
        if self._anchor is None:
            self._anchor = (sim_time, now)
        due = self._anchor[1] + (sim_time - self._anchor[0]) / self.speed
        if now > due + _BEHIND:
            self._anchor = (sim_time, now)
        return max(0.0, due - now)

    def factor(self) -> float:
        """The real-time factor of the last seconds."""
        if len(self._marks) < 2:
            return 0.0
        (first, began), (last, ended) = self._marks[0], self._marks[-1]
        return (last - first) / max(ended - began, 1e-9)
