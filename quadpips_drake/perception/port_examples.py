"""Example values that declare the type of an abstract port."""

import numpy as np

from quadpips_drake.robots.legs import NUM_JOINTS, NUM_LEGS
from quadpips_drake.robots.robot_state import RobotState


def example_robot_state() -> RobotState:
    """Returns a state with everything zero and the base aligned with the world."""
    return RobotState(
        stamp=0.0,
        p_WB=np.zeros(3),
        rpy_WB=np.zeros(3),
        R_WB=np.eye(3),
        v_WB=np.zeros(3),
        w_WB=np.zeros(3),
        joint_positions=np.zeros(NUM_JOINTS),
        joint_velocities=np.zeros(NUM_JOINTS),
        joint_torques=np.zeros(NUM_JOINTS),
        contact_forces=np.zeros((NUM_LEGS, 3)),
        contacts=np.zeros(NUM_LEGS, bool),
    )
