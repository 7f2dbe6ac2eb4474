"""What has happened, in words: what the systems of a trial say, what became of what was put in its way, what was done."""

from collections import deque
from dataclasses import dataclass

from quadpips_drake.cockpit.live_trial import LiveTrial
from quadpips_drake.trials.watching.notes import PLAN, PLANNER

KEPT = 60
"""Newest happenings that are kept."""


@dataclass(frozen=True)
class Happening:
    """One line of the list."""

    number: int
    """They count on, also over trials."""
    time: float
    """Simulated time [s]."""
    kind: str
    """"you": somebody did it; "robot"; "trouble"."""
    text: str


class Happenings:
    """The list of all, of several trials one after the other."""

    def __init__(self):
        self._count, self._kept = 0, deque(maxlen=KEPT)
        self._things: dict[str, tuple] = {}

    def forget(self) -> None:
        """Another trial begins: what there is to compare with is gone, the list stays."""
        self._things = {}

    def note(self, time: float, kind: str, text: str) -> None:
        """Adds one."""
        self._count += 1
        self._kept.append(Happening(self._count, round(time, 2), kind, text))

    def newest(self) -> tuple[Happening, ...]:
        """In the order in which they happened."""
        return tuple(self._kept)

    def look(self, live: LiveTrial) -> None:
        """Adds what is new."""
        for time, who, what in live.take_notes():
            self.note(time, "robot" if who in (PLANNER, PLAN) else "trouble", what if who == PLAN else f"{who}: {what}")
        self._look_at_things(live.noticed(), live.trial.context.get_time())

    def _look_at_things(self, things: dict[str, tuple], time: float) -> None:
        """Whether what was put in the way was noticed or touched."""
        for what, (noticed, touched_by) in things.items():
            noticed_before, touched_before = self._things.get(what, (False, ()))
            if noticed and not noticed_before:
                self.note(time, "robot", f"noticed {what.partition('@')[0]}")
            for link in touched_by:
                if link not in touched_before:
                    self.note(time, "trouble", f"{link} touched {what.partition('@')[0]}")
        self._things = things
