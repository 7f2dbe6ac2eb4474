"""The whole-body reference: what planning hands to tracking."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.robots.legs import NUM_LEGS, Leg
from quadpips_drake.values import ImmutableValue


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
        bounds = np.concatenate(([-np.inf], self.event_times, [np.inf]))
        intervals: list[tuple[float, float]] = []
        for i, down in enumerate(self.stance[:, leg]):
            if down:
                continue
            if intervals and intervals[-1][1] == bounds[i]:
                intervals[-1] = (intervals[-1][0], bounds[i + 1])
            else:
                intervals.append((bounds[i], bounds[i + 1]))
        return intervals

    def shifted(self, offset: float) -> "ContactSchedule":
        """The same schedule, ``offset`` seconds later."""
        return ContactSchedule(self.event_times + offset, self.stance)

    @staticmethod
    def standing() -> "ContactSchedule":
        """All feet down for ever."""
        return ContactSchedule(np.zeros(0), np.ones((1, NUM_LEGS), dtype=bool))


@dataclass(frozen=True, eq=False)
class FootholdTarget(ImmutableValue):
    """Where one foot comes down, and when; frame W."""

    leg: Leg
    liftoff_time: float
    """[s]"""
    touchdown_time: float
    """[s]"""
    position: np.ndarray
    """Centre of the foot sphere at touch-down [m], (3,): ground point + foot radius * normal."""
    normal: np.ndarray
    """Upward unit normal of the ground there, (3,)."""
    region: object = None
    """The PlanarRegion, or None on ground that nothing is known about."""
    ground: tuple = ()
    """PlanarRegions that the foot may pass over on its way there; empty: nothing is known."""


@dataclass(frozen=True, eq=False)
class WholeBodyReference(ImmutableValue):
    """States and inputs of the centroidal model over time, with contacts and footholds (QuadPiPS section VII-A).

    State x (24): linear momentum / mass [m/s], angular momentum about the centre of mass / mass [m^2/s] (both in W), base
    position p_WB [m], roll-pitch-yaw [rad], joints [rad]. Input u (24): ground force on each foot in W [N] (12), joint
    velocities [rad/s] (12).
    """

    stamp: float
    """Time of publication [s]."""
    request_id: int
    times: np.ndarray
    """Absolute times of the samples [s], (n,), increasing."""
    states: np.ndarray
    """(n, 24)"""
    inputs: np.ndarray
    """(n, 24)"""
    schedule: ContactSchedule
    """In absolute time."""
    footholds: tuple = ()
    """FootholdTargets in order of touch-down, absolute times."""

    @property
    def end_time(self) -> float:
        return float(self.times[-1])

    def shifted(self, offset: float, stamp: float) -> "WholeBodyReference":
        """The same reference, ``offset`` seconds later, published at ``stamp``."""
        footholds = tuple(
            replace(f, liftoff_time=f.liftoff_time + offset, touchdown_time=f.touchdown_time + offset)
            for f in self.footholds
        )
        return WholeBodyReference(
            stamp, self.request_id, self.times + offset, self.states, self.inputs, self.schedule.shifted(offset), footholds
        )

    def with_raised_footholds(self, height: float) -> "WholeBodyReference":
        """The same reference, with feet that come down ``height`` [m] higher."""
        offset = np.array([0.0, 0.0, height])
        footholds = tuple(replace(f, position=f.position + offset) for f in self.footholds)
        return replace(self, footholds=footholds)
