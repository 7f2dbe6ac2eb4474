"""The judge's rules, one by one."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.judge import JudgeConfig, TrialJudge
from quadpips_drake.values.robot_state import RobotState


def state(time=0.0, p=(0.0, 0.0, 0.55), rpy=(0.0, 0.0, 0.0)):
    zero3, zero12 = np.zeros(3), np.zeros(12)
    return RobotState(
        time, np.array(p), np.array(rpy), np.eye(3), zero3, zero3, zero12, zero12, zero12, np.zeros((4, 3)), np.ones(4, bool)
    )


@pytest.fixture
def terrain():
    return load_terrain("stepping_stones")


@pytest.fixture
def judge(terrain):
    return TrialJudge(terrain, JudgeConfig())


def feet_at(xy, z=0.0):
    return np.column_stack((np.tile(xy, (4, 1)), np.full(4, z)))


def test_walking_on_is_no_verdict(judge, terrain):
    start = np.array(terrain.start[:2])
    assert judge(state(p=(*start, 0.55)), feet_at(start), False) is None


@pytest.mark.parametrize("rpy", [(0.81, 0, 0), (0, -0.81, 0)])
def test_tilting_too_far_is_a_fall(judge, terrain, rpy):
    assert judge(state(rpy=rpy), feet_at(terrain.start[:2]), False).reason == "fell"


def test_a_torso_on_the_ground_is_a_fall(judge, terrain):
    assert judge(state(), feet_at(terrain.start[:2]), True).reason == "fell"


def test_a_foot_in_the_pit_has_left_the_terrain(judge, terrain):
    middle = (np.array(terrain.start[:2]) + np.array(terrain.goal)) / 2
    feet = feet_at(terrain.start[:2])
    feet[2] = [*middle, -0.14]
    assert judge(state(), feet, False) is None
    feet[2, 2] = -0.16
    assert judge(state(), feet, False).reason == "left_terrain"


def test_the_goal_has_to_be_held(judge, terrain):
    goal = np.array(terrain.goal)
    near, far = (goal[0] + 0.29, goal[1], 0.55), (goal[0] + 0.31, goal[1], 0.55)
    assert judge(state(0.0, near), feet_at(goal), False) is None
    assert judge(state(0.4, far), feet_at(goal), False) is None
    assert judge(state(0.5, near), feet_at(goal), False) is None
    assert judge(state(0.9, near), feet_at(goal), False) is None
    assert judge(state(1.0, near), feet_at(goal), False).reason == "goal_reached"


def test_a_state_that_is_not_finite_is_an_error(judge, terrain):
    assert judge(state(p=(np.nan, 0, 0)), feet_at(terrain.start[:2]), False).reason == "error"


@pytest.mark.parametrize("key", ["goal_tolerance", "max_tilt", "max_foot_drop"])
def test_limits_must_be_positive(key):
    with pytest.raises(UserInputError, match=key):
        JudgeConfig(**{key: -1.0})
