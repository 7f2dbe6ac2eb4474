"""What the MPC hands to whole-body control: a short plan of states, forces and swing feet, valid until the next one."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.math.interpolation import interpolate_at
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE, CentroidalInput, CentroidalState, foot_forces
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS, Leg


@dataclass(frozen=True, eq=False)
class PolicySample:
    """The policy at one instant."""

    p_WB: np.ndarray
    """Base position [m], (3,)."""
    rpy_WB: np.ndarray
    """Roll, pitch, yaw [rad], (3,)."""
    v_WB: np.ndarray
    """Velocity of the base origin in W [m/s], (3,)."""
    w_WB: np.ndarray
    """Angular velocity of the base in W [rad/s], (3,)."""
    joints: np.ndarray
    """[rad], (12,)."""
    joint_velocities: np.ndarray
    """[rad/s], (12,)."""
    forces: np.ndarray
    """Ground force on each foot in W [N], (4, 3)."""
    stance: np.ndarray
    """Planned contacts, bool (4,)."""


@dataclass(frozen=True, eq=False)
class MpcPolicy(ImmutableValue):
    """Solution of the MPC (QuadPiPS section VII-B) over its horizon, frame W; empty (no times) before the first solve."""

    stamp: float
    """Time of the state that it started from [s]."""
    times: np.ndarray
    """Knots [s], (N + 1,), increasing, absolute."""
    states: np.ndarray
    """Centroidal states (see CentroidalState), (N + 1, 24)."""
    inputs: np.ndarray
    """Forces and joint velocities, constant over each interval, (N, 24)."""
    base_twists: np.ndarray
    """Angular, then linear velocity of the base in W [rad/s, m/s], (N + 1, 6)."""
    schedule: ContactSchedule
    """Planned contacts in absolute time."""
    swings: tuple = ((), (), (), ())
    """For each leg its SwingSplines (current and coming) in order of time."""
    normals: np.ndarray = None
    """Unit normal of the ground under each foot, now or at its next touch-down, (4, 3)."""
    success: bool = False
    """Whether this is a fresh solution; False: an earlier one carried on."""
    status: str = "none"
    """The solver's word."""
    fallbacks: int = 0
    """How many solves have failed since the start."""
    solve_time: float = 0.0
    """Wall-clock time of the solve [s]."""

    @staticmethod
    def empty() -> "MpcPolicy":
        """No policy yet."""
        return MpcPolicy(
            stamp=-np.inf,
            times=np.zeros(0),
            states=np.zeros((0, STATE_SIZE)),
            inputs=np.zeros((0, INPUT_SIZE)),
            base_twists=np.zeros((0, 6)),
            schedule=ContactSchedule.standing(),
            normals=np.tile([0.0, 0.0, 1.0], (NUM_LEGS, 1)),
        )

    @property
    def is_empty(self) -> bool:
        return len(self.times) == 0

    def sample(self, time: float) -> PolicySample:
        """The policy at ``time`` [s], held at its ends: states linear between knots, inputs constant in between."""
        state, twist = np.empty(STATE_SIZE), np.empty(6)
        interpolate_at(time, self.times, self.base_twists, twist)
        k = interpolate_at(time, self.times, self.states, state)
        return PolicySample(
            p_WB=state[CentroidalState.POSITION],
            rpy_WB=state[CentroidalState.ORIENTATION],
            v_WB=twist[3:],
            w_WB=twist[:3],
            joints=state[CentroidalState.JOINTS],
            joint_velocities=self.inputs[k, CentroidalInput.JOINT_VELOCITIES],
            forces=foot_forces(self.inputs[k]),
            stance=self.schedule.at(time),
        )

    def swing(self, leg: Leg, time: float):
        """The SwingSpline of ``leg`` at ``time``: the one in progress, else the last one before, else None."""
        current = None
        for spline in self.swings[leg]:
            if spline.start_time <= time:
                current = spline
        return current
