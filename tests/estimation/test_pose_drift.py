"""The drifting pose estimate keeps the conventions of the robot state."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.estimation.pose_drift import drift_state
from quadpips_drake.math.rotations import rotation_from_rpy, yaw_matrix
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state


@pytest.mark.parametrize("yaw", [-3.1, 0.0, 1.0, 3.1])
@pytest.mark.parametrize("drift", [-0.2, 0.0, 0.2])
def test_yaw_stays_within_one_turn_and_agrees_with_the_rotation(yaw, drift):
    rpy = np.array([0.1, -0.2, yaw])
    state = replace(standing_state(load_robot("go2")), rpy_WB=rpy, R_WB=rotation_from_rpy(rpy))
    X_WO = np.eye(4)
    X_WO[:3, :3], X_WO[:3, 3] = yaw_matrix(drift), [0.3, -0.1, 0.05]
    drifted = drift_state(state, X_WO)
    assert -np.pi < drifted.rpy_WB[2] <= np.pi
    np.testing.assert_allclose(rotation_from_rpy(drifted.rpy_WB), drifted.R_WB, atol=1e-12)
