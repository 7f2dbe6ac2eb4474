"""The whole-body reference: what planning hands to tracking."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE, CentroidalInput, CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import PlanStart

_SAME_TIME = 1e-6
"""Samples closer than this are one [s]."""
SETTLING_TIME = 0.1
"""For so long after its planned touch-down a foothold still counts as coming [s]."""
_STOPPING_TIME = 0.3
"""In which the base comes to rest where a reference is cut off [s]."""
_STOPPING_SAMPLES = 6


@dataclass(frozen=True)
class ReferenceCut(ImmutableValue):
    """A wish to end a reference early."""

    follows: int = 0
    """Request id of that reference; 0: of none."""
    time: float = np.inf
    """From when on the robot shall stand: a moment with all feet down [s]."""

    @staticmethod
    def empty() -> "ReferenceCut":
        """Nothing is cut off."""
        return ReferenceCut()


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
    profile: np.ndarray | None = None
    """Lowest admissible heights of the foot centre in W at equal parts of the way there [m], (n,); None: unknown."""
    apex_height: float = 0.0
    """Least height of the swing's apex over the straight way [m]."""
    polygon: np.ndarray | None = None
    """Where on its region the foot has to stand: convex polygon [m], counter-clockwise, in the xy plane of the region's
    frame, (n, 2); None: anywhere within the region's boundary."""


@dataclass(frozen=True, eq=False)
class WholeBodyReference(ImmutableValue):
    """States and inputs of the centroidal model over time, with contacts and footholds (QuadPiPS section VII-A).

    State x (24): linear momentum / mass [m/s], angular momentum about the centre of mass / mass [m^2/s] (both in W), base
    position p_WB [m], roll-pitch-yaw [rad], joints [rad]. Input u (24): ground force on each foot in W [N] (12), joint
    velocities [rad/s] (12). CentroidalState and CentroidalInput name these parts.
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
    start: PlanStart | None = None
    """Of a plan that was made ahead: where it goes on from another one."""
    rolling: bool = False
    """Whether it is one of many that each go on for a moment from the one before, rather than a plan that is walked to its
    end: logs keep no such references."""

    @staticmethod
    def empty(stamp: float = -np.inf) -> "WholeBodyReference":
        """Asks for standing where one is: no samples, and the request id 0."""
        states, inputs = np.zeros((0, STATE_SIZE)), np.zeros((0, INPUT_SIZE))
        return WholeBodyReference(stamp, 0, np.zeros(0), states, inputs, ContactSchedule.standing())

    @property
    def end_time(self) -> float:
        return float(self.times[-1])

    @property
    def edition(self) -> tuple:
        """What is another one when there is something new to draw: id and stamp; of a rolling reference, its touch-downs."""
        if not self.rolling:
            return self.request_id, self.stamp
        return self.request_id, *(round(target.touchdown_time, 3) for target in self.footholds)

    def shifted(self, offset: float, stamp: float) -> "WholeBodyReference":
        """The same reference, ``offset`` seconds later, published at ``stamp``."""
        footholds = tuple(
            replace(f, liftoff_time=f.liftoff_time + offset, touchdown_time=f.touchdown_time + offset)
            for f in self.footholds
        )
        return WholeBodyReference(
            stamp, self.request_id, self.times + offset, self.states, self.inputs, self.schedule.shifted(offset), footholds
        )

    def continued_by(self, following: "WholeBodyReference", stamp: float) -> "WholeBodyReference":
        """This reference up to where ``following``, in absolute time, begins with all feet down, and that one from there on.

        What lies before the present full stance or swing at the time ``stamp`` [s] of publication is left out.
        """
        begin = following.times[0]
        kept = (self.times < begin - _SAME_TIME) & (self.times >= stamp - SETTLING_TIME)
        schedule = self.schedule.since_full_stance(stamp - SETTLING_TIME).until(begin).followed_by(following.schedule)
        footholds = [f for f in self.footholds if stamp - SETTLING_TIME < f.touchdown_time <= begin]
        return replace(
            following,
            stamp=stamp,
            times=np.concatenate((self.times[kept], following.times)),
            states=np.concatenate((self.states[kept], following.states)),
            inputs=np.concatenate((self.inputs[kept], following.inputs)),
            schedule=schedule,
            footholds=(*footholds, *following.footholds),
        )

    def ended_at(self, time: float, stamp: float) -> "WholeBodyReference":
        """This reference up to ``time`` [s], at which all feet are down; there the base comes to rest.

        It goes on as it moves at that moment, slower and slower, with its feet where they are. What lies before the present
        full stance or swing at the time ``stamp`` [s] of publication is left out.
        """
        kept = np.flatnonzero((self.times <= time + _SAME_TIME) & (self.times >= stamp - SETTLING_TIME))
        if not len(kept):
            raise ValueError(f"there is nothing to follow until {time:g} s")
        last = kept[-1]
        state, before = self.states[last], self.states[max(last - 1, 0)]
        rate = (state - before) / max(self.times[last] - self.times[max(last - 1, 0)], _SAME_TIME)
        parts = np.arange(1, _STOPPING_SAMPLES + 1)[:, None] / _STOPPING_SAMPLES
        states = state + _STOPPING_TIME * (parts - 0.5 * parts**2) * rate
        states[:, CentroidalState.MOMENTUM] = (1.0 - parts) * state[CentroidalState.MOMENTUM]
        inputs = np.tile(self.inputs[last], (_STOPPING_SAMPLES, 1))
        inputs[:, CentroidalInput.JOINT_VELOCITIES] *= 1.0 - parts
        return replace(
            self,
            stamp=stamp,
            times=np.concatenate((self.times[kept], self.times[last] + _STOPPING_TIME * parts[:, 0])),
            states=np.concatenate((self.states[kept], states)),
            inputs=np.concatenate((self.inputs[kept], inputs)),
            schedule=self.schedule.since_full_stance(stamp - SETTLING_TIME).until(time),
            footholds=tuple(f for f in self.footholds if stamp - SETTLING_TIME < f.touchdown_time <= time),
        )

    def with_raised_footholds(self, height: float) -> "WholeBodyReference":
        """The same reference, with feet that come down ``height`` [m] higher."""
        offset = np.array([0.0, 0.0, height])
        footholds = tuple(replace(f, position=f.position + offset) for f in self.footholds)
        return replace(self, footholds=footholds)
