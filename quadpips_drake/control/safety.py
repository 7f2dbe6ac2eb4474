"""Signs that a robot falls or is about to, as pure functions (QuadPiPS section VII-A: what aborts a reference)."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_state import RobotState


@dataclass
class SafetyConfig:
    """Bounds of what is still normal. The paper names the quantities but gives no numbers; these are ours."""

    max_tilt: float = 0.4
    """|roll| and |pitch| above which the robot counts as unstable [rad]."""
    fall_tilt: float = 0.8
    """|roll| and |pitch| above which it has fallen [rad]."""
    min_height_ratio: float = 0.5
    """Height of the base above its feet, as part of the nominal one, below which it has fallen [1]."""
    max_joint_speed_ratio: float = 1.0
    """Joint speed as part of its limit above which the robot counts as unstable [1]."""
    max_torque_ratio: float = 0.98
    """Joint torque as part of its limit that counts as saturated [1]."""
    max_saturated_joints: int = 3
    """As many saturated joints at once are still normal [1]."""

    def __post_init__(self):
        if not 0.0 < self.max_tilt <= self.fall_tilt:
            raise UserInputError("safety needs 0 < max_tilt <= fall_tilt")


def tilt(state: RobotState) -> float:
    """Larger of |roll| and |pitch| [rad]."""
    return float(np.max(np.abs(state.rpy_WB[:2])))


def height_above_feet(state: RobotState, robot) -> float:
    """Height of the base origin above the mean of the foot centres in W [m]."""
    feet_W = robot.foot_positions_B(state.joint_positions) @ state.R_WB.T
    return -float(np.mean(feet_W[:, 2]))


def fall_reason(state: RobotState, robot, config: SafetyConfig) -> str:
    """Why the robot counts as fallen; empty while it stands."""
    if tilt(state) > config.fall_tilt:
        return f"tilt {tilt(state):.2f} rad exceeds {config.fall_tilt} rad"
    height = height_above_feet(state, robot)
    if height < config.min_height_ratio * robot.nominal_base_height:
        return f"base only {height:.2f} m above its feet"
    return ""


def instability_reason(state: RobotState, robot, config: SafetyConfig) -> str:
    """Why the present reference should be aborted; empty in normal operation. A fall is an instability too."""
    reason = fall_reason(state, robot, config)
    if reason:
        return reason
    if tilt(state) > config.max_tilt:
        return f"tilt {tilt(state):.2f} rad exceeds {config.max_tilt} rad"
    speed = np.abs(state.joint_velocities) / robot.velocity_limits
    if np.max(speed) > config.max_joint_speed_ratio:
        return f"joint {robot.joint_names[int(np.argmax(speed))]} turns at {np.max(speed):.0%} of its speed limit"
    saturated = np.abs(state.joint_torques) > config.max_torque_ratio * np.asarray(robot.effort_limits)
    if np.count_nonzero(saturated) > config.max_saturated_joints:
        return f"{np.count_nonzero(saturated)} joints at their torque limit"
    return ""
