"""Terms of the rigid-body dynamics against finite differences and conservation laws."""

from dataclasses import fields, replace

import numpy as np
import pytest

from quadpips_drake.control.whole_body.robot_dynamics import RobotDynamics
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from tests.control.whole_body.plant_dynamics import PlantDynamics


def _moving(robot):
    rng = np.random.default_rng(1)
    rpy = np.array([0.1, -0.2, 0.5])
    return replace(
        standing_state(robot),
        rpy_WB=rpy,
        R_WB=rotation_from_rpy(rpy),
        v_WB=rng.normal(size=3),
        w_WB=rng.normal(size=3),
        joint_positions=np.array(robot.nominal_joints) + 0.2 * rng.normal(size=12),
        joint_velocities=3.0 * rng.normal(size=12),
    )


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_all_terms_agree_with_a_multibody_plant(name):
    robot = load_robot(name)
    state = _moving(robot)
    ours, drakes = RobotDynamics(robot).evaluate(state), PlantDynamics(robot).evaluate(state)
    for field in fields(ours):
        expected = getattr(drakes, field.name)
        assert getattr(ours, field.name) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max()), field.name


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_feet_agree_with_the_robot_model(name):
    robot = load_robot(name)
    state = _moving(robot)
    terms = RobotDynamics(robot).evaluate(state)
    legs_B = robot.foot_positions_B(state.joint_positions)
    arms = legs_B @ state.R_WB.T
    assert terms.p_WF == pytest.approx(state.p_WB + arms)
    legs_v = np.einsum("lij,lj->li", robot.foot_jacobians_B(state.joint_positions), state.joint_velocities.reshape(4, 3))
    assert terms.v_WF == pytest.approx(state.v_WB + np.cross(state.w_WB, arms) + legs_v @ state.R_WB.T)


def test_a_robot_at_rest_is_pulled_down_by_its_weight():
    robot = load_robot("go2")
    bias = RobotDynamics(robot).evaluate(standing_state(robot)).bias
    assert bias[3:6] == pytest.approx([0.0, 0.0, GRAVITY * robot.mass], rel=1e-3)
