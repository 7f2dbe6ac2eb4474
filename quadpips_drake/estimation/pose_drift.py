"""A pose estimate that drifts away from the truth, as odometry without landmarks does."""

import dataclasses

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.values.robot_state import RobotState


@configuration
class PoseDriftConfig:
    """How fast the frame that the estimator takes for the world moves; all zero (the default): a perfect estimate.

    Legged odometry drifts by about 1 % of the way: 0.003 m/s at walking pace, and some 0.002 rad/s in yaw.
    """

    horizontal_rate: float = ranged(0.0, 0.0, 0.5)
    """Speed of the drift in the horizontal plane, in a direction that the seed chooses [m/s]."""
    vertical_rate: float = ranged(0.0, 0.0, 0.5)
    """Speed of the drift in height, up or down as the seed chooses [m/s]."""
    yaw_rate: float = ranged(0.0, 0.0, 0.5)
    """Rate of the drift in yaw, to the side that the seed chooses [rad/s]."""

    @property
    def enabled(self) -> bool:
        return max(self.horizontal_rate, self.vertical_rate, self.yaw_rate) > 0.0


def drifted_world(stamp: float, seed: int, config: PoseDriftConfig) -> np.ndarray:
    """Returns X_WO (4, 4) at time ``stamp`` [s]: the true pose of the frame O that the estimator takes for the world W."""
    generator = np.random.default_rng([seed, 4])
    direction, signs = generator.uniform(-np.pi, np.pi), generator.choice([-1.0, 1.0], 2)
    yaw = signs[0] * config.yaw_rate * stamp
    X_WO = np.eye(4)
    X_WO[:3, :3] = yaw_matrix(yaw)
    X_WO[:2, 3] = config.horizontal_rate * stamp * np.array([np.cos(direction), np.sin(direction)])
    X_WO[2, 3] = signs[1] * config.vertical_rate * stamp
    return X_WO


def drift_state(state: RobotState, X_WO: np.ndarray) -> RobotState:
    """Returns ``state`` expressed in O instead of W."""
    R_OW = X_WO[:3, :3].T
    yaw = np.arctan2(R_OW[1, 0], R_OW[0, 0])
    rpy = np.array([*state.rpy_WB[:2], wrap_angle(state.rpy_WB[2] + yaw)])
    return dataclasses.replace(
        state,
        p_WB=R_OW @ (state.p_WB - X_WO[:3, 3]),
        rpy_WB=rpy,
        R_WB=R_OW @ state.R_WB,
        v_WB=R_OW @ state.v_WB,
        w_WB=R_OW @ state.w_WB,
        contact_forces=state.contact_forces @ R_OW.T,
    )
