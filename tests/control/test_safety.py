"""Signs of a fall."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.safety import SafetyConfig, fall_reason, height_above_feet, instability_reason
from quadpips_drake.control.standing import standing_state
from quadpips_drake.control.whole_body_targets import rotation_matrix
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_model import load_robot

ROBOT = load_robot("anymal_c")


def _tilted(roll):
    rpy = np.array([roll, 0.0, 0.0])
    return replace(standing_state(ROBOT), rpy_WB=rpy, R_WB=rotation_matrix(rpy))


def test_a_standing_robot_is_safe():
    state = standing_state(ROBOT)
    assert instability_reason(state, ROBOT, SafetyConfig()) == ""
    assert height_above_feet(state, ROBOT) == pytest.approx(ROBOT.nominal_base_height - ROBOT.foot_radius)


def test_tilt_first_aborts_and_then_counts_as_a_fall():
    assert "tilt" in instability_reason(_tilted(0.5), ROBOT, SafetyConfig())
    assert fall_reason(_tilted(0.5), ROBOT, SafetyConfig()) == ""
    assert "tilt" in fall_reason(_tilted(-0.9), ROBOT, SafetyConfig())


def test_speed_torque_and_height_are_watched():
    state = standing_state(ROBOT)
    fast = replace(state, joint_velocities=np.full(12, 20.0))
    assert "speed" in instability_reason(fast, ROBOT, SafetyConfig())
    weak = replace(state, joint_torques=np.array(ROBOT.effort_limits))
    assert "torque limit" in instability_reason(weak, ROBOT, SafetyConfig())
    folded = replace(state, joint_positions=np.tile([0.0, 1.4, -2.7], 4) * np.repeat([1, 1, -1, -1], 3))
    assert "above its feet" in fall_reason(folded, ROBOT, SafetyConfig())


def test_bounds_must_make_sense():
    with pytest.raises(UserInputError, match="max_tilt"):
        SafetyConfig(max_tilt=1.0, fall_tilt=0.5)
