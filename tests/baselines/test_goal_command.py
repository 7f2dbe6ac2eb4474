"""The twist towards the goal: the law of the paper's baselines."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.baselines.goal_command import GoalCommandConfig, goal_command
from quadpips_drake.control.references.velocity_reference import STANCE
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state


def state_at(x, y, yaw):
    state = standing_state(load_robot("anymal_c"))
    return replace(state, p_WB=np.array([x, y, 0.5]), rpy_WB=np.array([0.0, 0.0, yaw]))


@pytest.mark.parametrize("seed", range(20))
def test_constant_speed_to_the_goal_and_a_turn_in_proportion(seed):
    rng = np.random.default_rng(seed)
    state, goal = state_at(*rng.uniform(-1.0, 1.0, 2), rng.uniform(-3.1, 3.1)), rng.uniform(2.0, 4.0, 2)
    config = GoalCommandConfig(speed=0.4, yaw_gain=0.7)
    found = goal_command(state, goal, config)
    way = goal - state.p_WB[:2]
    velocity_W = yaw_matrix(state.rpy_WB[2])[:2, :2] @ found.velocity[:2]
    np.testing.assert_allclose(velocity_W, 0.4 * way / np.hypot(*way), atol=1e-12)
    error = found.velocity[2] / 0.7
    assert abs(error) <= np.pi and np.isclose(np.sin(state.rpy_WB[2] + error - np.arctan2(way[1], way[0])), 0.0, atol=1e-9)
    assert found.gait == "trot" and found.distance == pytest.approx(np.hypot(*way)) and not found.is_at_goal


def test_nothing_within_the_stop_distance():
    near, far = (goal_command(state_at(x, 0.0, 1.0), np.zeros(2), GoalCommandConfig()) for x in (0.249, 0.251))
    assert near.gait == STANCE and not near.velocity.any() and near.is_at_goal
    assert far.gait == "trot" and np.hypot(*far.velocity[:2]) == pytest.approx(0.25)


def test_the_defaults_are_those_of_the_authors_harness():
    c = GoalCommandConfig()
    assert (c.rate, c.speed, c.yaw_gain, c.stop_distance, c.gait) == (10.0, 0.25, 0.25, 0.25, "trot")
