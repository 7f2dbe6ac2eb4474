"""Equations (1) to (5): what goes into the models, and what becomes of a state with what comes out."""

import dataclasses

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.state import (
    COMMAND,
    CONSTANT,
    FEET,
    INPUTS,
    OUTPUTS,
    PAIRS,
    PREVIOUS_COMMAND,
    PREVIOUS_VELOCITY,
    TURN,
    VELOCITY,
    StepState,
    measured_outputs,
    measured_step_state,
    mirrored_inputs,
    mirrored_outputs,
)
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.robot_state import RobotState


def some_state(rng, swing: int = 0) -> StepState:
    """A state that has nothing to do with a walk."""
    return StepState(
        position=rng.normal(size=2),
        yaw=float(rng.uniform(-np.pi, np.pi)),
        velocity=rng.normal(size=2),
        previous_velocity=rng.normal(size=2),
        previous_command=rng.normal(size=3),
        feet=rng.normal(size=(4, 2)),
        swing=swing,
        yaw_rate=float(rng.normal()),
        previous_yaw_rate=float(rng.normal()),
    )


@pytest.mark.parametrize("swing", [0, 1])
def test_what_comes_out_is_found_again_in_the_next_state_whatever_the_yaw(swing):
    rng = np.random.default_rng(swing)
    for _ in range(20):
        now, outputs, command = some_state(rng, swing), rng.normal(size=OUTPUTS), rng.normal(size=3)
        then = now.after(command, outputs)
        np.testing.assert_allclose(measured_outputs(now, then), outputs, atol=1e-12)
        assert then.swing == 1 - swing
        standing = [leg for leg in Leg if leg not in PAIRS[swing]]
        np.testing.assert_allclose(then.feet_W[standing], now.feet_W[standing], atol=1e-12)


def test_a_forward_step_goes_where_the_robot_faces():
    now = StepState(np.array([1.0, 2.0]), np.pi / 2, np.zeros(2), np.zeros(2), np.zeros(3), np.zeros((4, 2)), swing=1)
    then = now.after(np.zeros(3), np.array([0.1, 0.0, 0.2, 0.0, 0.2, 0.0, 0.5, 0.0]))
    np.testing.assert_allclose(then.position, [1.0, 2.1], atol=1e-12)
    np.testing.assert_allclose(then.feet[Leg.RF], [0.1, 0.0], atol=1e-12)  # equation (5): 0.2 ahead, less the base's 0.1
    np.testing.assert_allclose(then.feet[Leg.LF], [-0.1, 0.0], atol=1e-12)
    np.testing.assert_allclose(then.velocity, [0.5, 0.0])


def test_inputs_lie_where_the_layout_says_and_are_remembered_for_one_step():
    rng = np.random.default_rng(3)
    now, command, outputs = some_state(rng), rng.normal(size=3), rng.normal(size=OUTPUTS)
    x, later = now.inputs(command), now.after(command, outputs).inputs(np.zeros(3))
    assert x.shape == (INPUTS,) and x[CONSTANT] == 1.0
    np.testing.assert_array_equal(x[VELOCITY], now.velocity)
    np.testing.assert_array_equal(x[FEET], now.feet.ravel())
    np.testing.assert_array_equal(later[PREVIOUS_VELOCITY], x[VELOCITY])
    np.testing.assert_array_equal(later[PREVIOUS_COMMAND], x[COMMAND])
    assert later[TURN][3] == command[2]


def test_a_measurement_gives_the_state_in_the_heading_frame_on_a_slope_too():
    yaw = 0.7
    rpy = np.array([0.2, -0.3, yaw])
    feet_W = np.random.default_rng(4).normal(size=(4, 3))
    state = dataclasses.replace(
        RobotState.empty(),
        stamp=1.0,
        p_WB=np.array([3.0, -1.0, 0.5]),
        rpy_WB=rpy,
        R_WB=rotation_from_rpy(rpy),
        v_WB=np.array([np.cos(yaw), np.sin(yaw), 0.3]),
        w_WB=np.array([0.0, 0.0, 0.4]),
    )
    measured = measured_step_state(state, feet_W, 1, None, np.zeros(3))
    np.testing.assert_allclose(measured.velocity, [1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(measured.feet_W, feet_W[:, :2], atol=1e-12)
    np.testing.assert_array_equal(measured.previous_velocity, 0.0)
    after = measured_step_state(state, feet_W, 0, measured, np.array([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(after.previous_velocity, measured.velocity)
    assert after.previous_yaw_rate == 0.4


def test_a_mirror_swaps_the_legs_of_left_and_right_and_shows_itself_in_a_mirror():
    rng = np.random.default_rng(5)
    now, command, outputs = some_state(rng), rng.normal(size=3), rng.normal(size=OUTPUTS)
    x, seen = now.inputs(command), mirrored_inputs(now.inputs(command))
    np.testing.assert_array_equal(mirrored_inputs(seen), x)
    np.testing.assert_array_equal(mirrored_outputs(mirrored_outputs(outputs)), outputs)
    np.testing.assert_array_equal(seen[FEET].reshape(4, 2)[Leg.RF], now.feet[Leg.LF] * [1.0, -1.0])
    np.testing.assert_array_equal(seen[COMMAND], command[:2] * [1.0, -1.0])
    np.testing.assert_array_equal(seen[TURN], -x[TURN])
    assert seen[CONSTANT] == 1.0
