"""When each foot is on the ground."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS, Leg


@dataclass(frozen=True, eq=False)
class ContactSchedule(ImmutableValue):
    """Which feet are on the ground, when. ``stance[i]`` holds from ``event_times[i - 1]`` to ``event_times[i]``."""

    event_times: np.ndarray
    """Increasing times at which the set of stance feet changes [s], shape (m - 1,)."""
    stance: np.ndarray
    """bool, shape (m, 4): the first row holds before the first event, the last row after the last one."""

    def at(self, time: float) -> np.ndarray:
        """Stance flags, bool (4,), at ``time``; an event belongs to the mode that it begins."""
        return self.stance[np.searchsorted(self.event_times, time, side="right")]

    def swings(self, leg: Leg) -> list[tuple[float, float]]:
        """Intervals (lift-off, touch-down) in which ``leg`` swings, in order; +-inf where the schedule starts or ends so."""
        return list(self._swings[leg])

    @cached_property
    def _swings(self) -> list[list[tuple[float, float]]]:
        """What ``swings`` returns, for each leg; nothing in it can change."""
        bounds = [-np.inf, *self.event_times.tolist(), np.inf]
        found: list[list[tuple[float, float]]] = [[] for _ in Leg]
        for i, row in enumerate(self.stance.tolist()):
            for leg, down in enumerate(row):
                if down:
                    continue
                intervals = found[leg]
                if intervals and intervals[-1][1] == bounds[i]:
                    intervals[-1] = (intervals[-1][0], bounds[i + 1])
                else:
                    intervals.append((bounds[i], bounds[i + 1]))
        return found

    def shifted(self, offset: float) -> "ContactSchedule":
        """The same schedule, ``offset`` seconds later."""
        return ContactSchedule(self.event_times + offset, self.stance)

    def since_full_stance(self, time: float) -> "ContactSchedule":
        """The same schedule without what lies before the last moment until ``time`` at which all feet came down."""
        begun = np.flatnonzero(self.stance[1:].all(axis=1) & (self.event_times <= time))
        first = begun[-1] + 1 if len(begun) else 0
        return ContactSchedule(self.event_times[first:], self.stance[first:])

    def full_stances(self) -> list[tuple[float, float]]:
        """Intervals (begin, end) in which all feet are down, in order; +-inf where the schedule starts or ends so."""
        bounds = [-np.inf, *self.event_times.tolist(), np.inf]
        return [(bounds[i], bounds[i + 1]) for i in np.flatnonzero(self.stance.all(axis=1))]

    def until(self, time: float) -> "ContactSchedule":
        """The same schedule up to ``time``, at which all feet are down, and standing from there on."""
        events = int(np.searchsorted(self.event_times, time, side="right"))
        return ContactSchedule(self.event_times[:events], self.stance[: events + 1])

    def followed_by(self, other: "ContactSchedule") -> "ContactSchedule":
        """This schedule, which ends with all feet down, and then ``other``, which begins so."""
        return ContactSchedule(
            np.concatenate((self.event_times, other.event_times)), np.concatenate((self.stance, other.stance[1:]))
        )

    @staticmethod
    def empty() -> "ContactSchedule":
        """Nothing is planned: stand."""
        return ContactSchedule.standing()

    @staticmethod
    def standing() -> "ContactSchedule":
        """All feet down for ever."""
        return ContactSchedule(np.zeros(0), np.ones((1, NUM_LEGS), dtype=bool))
