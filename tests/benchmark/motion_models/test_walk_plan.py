"""The velocities that walks go through."""

from itertools import pairwise

import numpy as np

from quadpips_drake.benchmark.motion_models.walk_plan import MOST_STEPS, plan_walks, speeds_up_to


def anything(velocity):
    """Legs that can do everything."""
    return velocity


def test_each_ordered_pair_of_speeds_comes_once_before_any_comes_twice():
    speeds = speeds_up_to(1.0)
    np.testing.assert_allclose(speeds, np.arange(11) / 10)
    walks = plan_walks(20, 66, speeds, 1, feasible=anything)
    order = [walks[0].commands[0].velocity[0]]
    for walk in walks:
        assert walk.commands[0].velocity[0] == order[-1]  # what the one before ended with: no pair is lost
        order += [command.velocity[0] for command in walk.commands[1:]]
    first_round = list(pairwise(order))[: 11 * 11]
    assert len(set(first_round)) == 11 * 11


def test_walks_have_their_length_and_holds_theirs():
    walks = plan_walks(12, 66, speeds_up_to(1.0), 1, feasible=anything)
    assert {sum(command.steps for command in walk.commands) for walk in walks} == {66}
    holds = {command.steps for walk in walks for command in walk.commands}
    assert holds == set(range(1, MOST_STEPS + 1))
    on_top = {command.velocity[1:] for walk in walks for command in walk.commands}
    assert on_top == {(0.0, 0.0), (0.2, 0.0), (-0.2, 0.0), (0.0, 0.3), (0.0, -0.3)}


def test_a_walk_depends_on_the_seed_and_its_number_alone():
    few, many = (plan_walks(n, 66, speeds_up_to(1.0), 1, feasible=anything) for n in (3, 9))
    assert few == many[:3]
    assert plan_walks(3, 66, speeds_up_to(1.0), 2, feasible=anything) != few


def test_nothing_is_asked_that_legs_cannot_do():
    def slow(velocity):
        return velocity * min(1.0, 0.45 / max(np.abs(velocity).sum(), 1e-9))

    walks = plan_walks(6, 40, speeds_up_to(0.45), 1, feasible=slow)
    asked = [np.abs(command.velocity).sum() for walk in walks for command in walk.commands]
    assert max(asked) <= 0.45 + 1e-9
    assert max(command.velocity[0] for walk in walks for command in walk.commands) == 0.4


def test_splits_are_mixed_and_uneven_ground_is_spread_and_walked_straight():
    walks = plan_walks(16, 66, speeds_up_to(1.0), 1, feasible=anything, bumpy_share=0.25)
    assert [walk.split for walk in walks[:3]] == ["train", "train", "val"]
    assert {walk.split for walk in walks} == {"train", "val", "test"}
    assert [walk.number for walk in walks if walk.bumpy] == [3, 7, 11, 15]
    assert all(command.is_straight for walk in walks if walk.bumpy for command in walk.commands)
