"""The whole-body reference: what planning hands to tracking."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import Leg


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

    @staticmethod
    def empty(stamp: float = -np.inf) -> "WholeBodyReference":
        """Asks for standing where one is: no samples, and the request id 0."""
        states, inputs = np.zeros((0, STATE_SIZE)), np.zeros((0, INPUT_SIZE))
        return WholeBodyReference(stamp, 0, np.zeros(0), states, inputs, ContactSchedule.standing())

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
