"""How a robot stands on the ground at a start."""

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.legs import Leg


def standing_pose(robot: RobotModel, truth: GroundTruth, x: float, y: float, yaw: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns base position [m] and joint angles (12,) of the robot standing on the ground with its torso level.

    The torso is at nominal height above the mean ground under the feet.
    """
    where = f"start {x:g},{y:g},{yaw:g}"
    heading = yaw_matrix(yaw)
    feet = robot.nominal_footholds_B @ heading.T + [x, y, 0.0]
    heights = np.asarray(truth.height(feet[:, 0], feet[:, 1]))
    if not np.isfinite(heights).all():
        missing = Leg(int(np.flatnonzero(~np.isfinite(heights))[0])).name
        raise UserInputError(f"{where}: there is no ground under the foot {missing}; start where all four feet find some")
    # The centre of a sphere that rests on a slope is radius / n_z above the slope, measured vertically.
    feet[:, 2] = heights + robot.foot_radius / np.maximum(truth.normal(feet[:, 0], feet[:, 1])[:, 2], 0.5)
    p_WB = np.array([x, y, heights.mean() + robot.nominal_base_height])
    q = np.empty(len(robot.joint_names))
    for leg in Leg:
        p_BF = (feet[leg] - p_WB) @ heading
        q[leg.joints], reached = robot.leg_inverse_kinematics_B(leg, p_BF)
        if not reached:
            raise UserInputError(f"{where}: the ground under the foot {leg.name} is out of reach; start on more even ground")
    return p_WB, q
