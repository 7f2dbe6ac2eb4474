"""Standing still: an example state, and the base pose that belongs above four feet."""

import numpy as np

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.values.legs import NUM_JOINTS, NUM_LEGS
from quadpips_drake.values.robot_state import RobotState


def standing_state(robot, stamp: float = 0.0) -> RobotState:
    """The robot at rest in its nominal stance at the origin of flat ground z = 0, its weight shared by all feet."""
    forces = np.tile([0.0, 0.0, GRAVITY * robot.mass / NUM_LEGS], (NUM_LEGS, 1))
    return RobotState(
        stamp=stamp,
        p_WB=np.array([0.0, 0.0, robot.nominal_base_height]),
        rpy_WB=np.zeros(3),
        R_WB=np.eye(3),
        v_WB=np.zeros(3),
        w_WB=np.zeros(3),
        joint_positions=np.array(robot.nominal_joints),
        joint_velocities=np.zeros(NUM_JOINTS),
        joint_torques=np.zeros(NUM_JOINTS),
        contact_forces=forces,
        contacts=np.ones(NUM_LEGS, dtype=bool),
    )
