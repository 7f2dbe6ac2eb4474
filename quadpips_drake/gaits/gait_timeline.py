"""Which gait is walked when: a phase that survives replans, and changes of gait without a foot left in the air."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from quadpips_drake.gaits.gaits import Gait
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS, Leg

_TOLERANCE = 1e-6
"""Times closer than this are the same [s]."""
_KEEP = 1.0
"""How long past swings stay in the schedule [s]: the MPC looks back at the last one of each foot."""


@dataclass(frozen=True, eq=False)
class GaitSegment(ImmutableValue):
    """A stretch of time in one gait, entered at any phase and left at any time.

    A foot that would be in mid-swing at ``start`` stays down until its next swing; from ``end`` on no foot is lifted any
    more, and swings under way are finished.
    """

    gait: Gait
    start: float
    """[s]"""
    phase: float = 0.0
    """Part of the cycle that is over at ``start``, 0..1."""
    end: float = np.inf
    """[s]"""

    def phase_at(self, time: float) -> float:
        """Part of the cycle that is over at ``time`` [s], 0..1."""
        return float(((time - self.start) / self.gait.duration + self.phase) % 1.0)

    def swings(self, since: float, until: float) -> list[tuple[Leg, float, float]]:
        """(leg, lift-off, touch-down) of the swings that end after ``since`` and begin before ``until`` [s]."""
        duration = self.gait.duration
        origin = self.start - self.phase * duration
        end = min(until, self.end)
        first = int(np.floor((max(since, self.start) - origin) / duration)) - 2
        last = int(np.ceil((end - origin) / duration)) + 1
        found = []
        for leg, offset, length in _cycle_swings(self.gait):
            for cycle in range(first, last):
                liftoff = origin + cycle * duration + offset
                in_time = self.start - _TOLERANCE <= liftoff < end - _TOLERANCE
                if in_time and liftoff + length > since:
                    found.append((leg, liftoff, liftoff + length))
        return found

    def settled(self) -> float:
        """When all feet are down after ``end`` [s]."""
        swings = self.swings(self.end - self.gait.duration, self.end)
        return max([self.end, *(touchdown for _, _, touchdown in swings)])


@dataclass(frozen=True, eq=False)
class GaitTimeline(ImmutableValue):
    """The segments of a walk in order; the last one goes on for ever."""

    segments: tuple[GaitSegment, ...]

    @property
    def gait(self) -> Gait:
        """The gait of the last segment."""
        return self.segments[-1].gait

    def is_under_way(self, time: float) -> bool:
        """Whether the last segment has begun."""
        return time >= self.segments[-1].start

    def phase_at(self, time: float) -> float:
        """Phase of the gait that is walked at ``time`` [s], 0..1; it is continued while a change of gait is under way."""
        begun = [segment for segment in self.segments if segment.start <= time]
        return (begun[-1] if begun else self.segments[0]).phase_at(time)

    def changed_to(self, gait: Gait, now: float, *, lead: float, pause: float) -> "GaitTimeline":
        """The timeline with a change to ``gait`` as soon as may be.

        No foot is lifted after ``now + lead``; when the last one is down, and ``pause`` later, the new gait begins with the
        lift-off whose phase is nearest to the phase that the old gait would have had. A change that has not begun yet is
        replaced.

        Args:
            gait: what to walk from then on.
            now: [s]
            lead: how much of the near future stays as it was [s].
            pause: how long all feet stay down between the gaits [s].
        """
        *earlier, last = self.segments
        if last.gait.name == gait.name:
            return self
        if earlier and last.start > now:
            return GaitTimeline((*earlier, GaitSegment(gait, last.start, _entry_phase(gait, last.phase))))
        closed = replace(last, end=now + lead)
        start = closed.settled() + pause
        recent = [segment for segment in earlier if segment.end > now - 2.0 * _KEEP - segment.gait.duration]
        entry = _entry_phase(gait, last.phase_at(start) if _cycle_swings(last.gait) else 0.0)
        return GaitTimeline((*recent, closed, GaitSegment(gait, start, entry)))

    def schedule(self, now: float, until: float) -> ContactSchedule:
        """Contacts in absolute time, right from a second before ``now`` up to ``until`` [s]."""
        swings = [swing for segment in self.segments for swing in segment.swings(now - _KEEP, until)]
        return schedule_of(swings)


def standing_timeline(stance: Gait) -> GaitTimeline:
    """Standing all along; ``stance`` is a gait without swings."""
    return GaitTimeline((GaitSegment(stance, 0.0),))


def schedule_of(swings: list[tuple[Leg, float, float]]) -> ContactSchedule:
    """The schedule in which each (leg, lift-off, touch-down) [s] is in the air, and everything else on the ground."""
    if not swings:
        return ContactSchedule.standing()
    bounds = np.array([(liftoff, touchdown) for _, liftoff, touchdown in swings])
    events = np.unique(np.round(bounds / _TOLERANCE)) * _TOLERANCE
    middle = np.concatenate(([events[0] - 1.0], 0.5 * (events[:-1] + events[1:]), [events[-1] + 1.0]))
    stance = np.ones((len(middle), NUM_LEGS), dtype=bool)
    for (leg, _, _), (liftoff, touchdown) in zip(swings, bounds, strict=True):
        stance[(middle > liftoff) & (middle < touchdown), leg] = False
    return ContactSchedule(events, stance)


def _entry_phase(gait: Gait, phase: float) -> float:
    """The phase nearest to ``phase`` at which a foot is lifted."""
    entries = [offset / gait.duration for _, offset, _ in _cycle_swings(gait)]
    return min(entries, key=lambda entry: abs((entry - phase + 0.5) % 1.0 - 0.5), default=0.0)


@cache
def _cycle_swings(gait: Gait) -> tuple[tuple[Leg, float, float], ...]:
    """(leg, lift-off after the beginning of the cycle, length) of each swing that begins in a cycle [s]."""
    schedule = gait.schedule(0.0, 4.0 * gait.duration)
    found = []
    for leg in Leg:
        for liftoff, touchdown in schedule.swings(leg):
            if gait.duration - _TOLERANCE < liftoff < 2.0 * gait.duration - _TOLERANCE:
                found.append((leg, liftoff - gait.duration, touchdown - liftoff))
    return tuple(found)
