"""The measured or estimated state of the robot, as every stage after the sensors sees it."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_JOINTS, NUM_LEGS


@dataclass(frozen=True, eq=False)
class RobotState(ImmutableValue):
    """State of the floating base (frame B), joints and feet, expressed in the world frame W unless said otherwise."""

    stamp: float
    """Time of the measurement [s]."""
    p_WB: np.ndarray
    """Position of the base origin [m], shape (3,)."""
    rpy_WB: np.ndarray
    """Roll, pitch, yaw [rad], shape (3,): R_WB = Rz(yaw) Ry(pitch) Rx(roll); yaw in (-pi, pi]."""
    R_WB: np.ndarray
    """Rotation matrix of the base, shape (3, 3)."""
    v_WB: np.ndarray
    """Linear velocity of the base origin in W [m/s], shape (3,)."""
    w_WB: np.ndarray
    """Angular velocity of the base, expressed in W [rad/s], shape (3,)."""
    joint_positions: np.ndarray
    """[rad], shape (12,), leg by leg (LF, RF, LH, RH), each HAA, HFE, KFE."""
    joint_velocities: np.ndarray
    """[rad/s], shape (12,)."""
    joint_torques: np.ndarray
    """Torques that the actuators applied last [N m], shape (12,)."""
    contact_forces: np.ndarray
    """Force of the ground on each foot in W [N], shape (4, 3)."""
    contacts: np.ndarray
    """Whether each foot touches the ground, bool, shape (4,)."""

    @property
    def is_known(self) -> bool:
        """Whether this is an estimate at all: before an estimator's first one there is none."""
        return self.stamp > -np.inf

    @staticmethod
    def empty() -> "RobotState":
        """Nothing was measured yet: everything is zero."""
        zero, joints = np.zeros(3), np.zeros(NUM_JOINTS)
        return RobotState(
            stamp=-np.inf,
            p_WB=zero,
            rpy_WB=zero,
            R_WB=np.eye(3),
            v_WB=zero,
            w_WB=zero,
            joint_positions=joints,
            joint_velocities=joints,
            joint_torques=joints,
            contact_forces=np.zeros((NUM_LEGS, 3)),
            contacts=np.zeros(NUM_LEGS, dtype=bool),
        )
