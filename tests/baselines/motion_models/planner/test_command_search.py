"""The search over velocity commands: against its readable twin, against trying everything, and in small worlds."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.planner import search_kernels as kernels
from quadpips_drake.baselines.motion_models.planner.command_search import CommandSearch, CommandSearchConfig, PlanKind
from quadpips_drake.baselines.motion_models.state import PAIRS, StepState
from quadpips_drake.errors import UserInputError
from tests.baselines.motion_models.planner import search_twin as twin
from tests.baselines.motion_models.planner.worlds import FEET_B, GOAL, LINE, ground, ideal, sluggish, standing

LEVEL = np.zeros(4)


def plan(start, world, *, models=None, goal=GOAL, turn=0.0, acceleration=np.inf, **settings):
    search = CommandSearch(models or ideal(), CommandSearchConfig(**settings), acceleration=acceleration)
    return search.plan(start, LEVEL, turn, world, goal, LINE, stamp=1.0, id=4)


def random_start(rng) -> StepState:
    feet = FEET_B + rng.uniform(-0.05, 0.05, (4, 2))
    velocity, before, command = rng.uniform(-0.1, 0.6, (3, 2))
    place, yaw = rng.uniform(-0.1, 0.1, 2), rng.uniform(-0.2, 0.2)
    return StepState(place, yaw, velocity, before, np.array([*command, 0.05]), feet, int(rng.integers(2)), 0.02, -0.01)


def random_ground(rng):
    holes = np.column_stack((rng.uniform(0.0, 2.0, 25), rng.uniform(-0.5, 0.5, 25)))
    first = rng.uniform(0.5, 0.9)
    return ground([(first, first + 0.1)], step=(rng.uniform(1.2, 1.6), 0.03), holes=holes)


@pytest.mark.parametrize("seed", range(12))
def test_it_does_what_its_readable_twin_does(seed):
    rng = np.random.default_rng(seed)
    config = CommandSearchConfig(
        horizon=int(rng.integers(2, 8)),
        accumulate=seed % 4 == 3,
        sideways=0.1 if seed % 3 == 0 else 0.0,
        max_expansions=60 if seed % 5 == 4 else 300,
        clearance_sigmas=2.0 if seed % 2 else 0.0,
    )
    acceleration = 2.0 if seed % 3 == 1 else np.inf
    search = CommandSearch(sluggish(), config, acceleration=acceleration)
    problem = search._problem(random_start(rng), LEVEL, 0.03, random_ground(rng), GOAL, LINE)
    swing = int(rng.integers(2))
    end, expansions, rows, actions, costs, distances = kernels.search_commands(problem[0], swing, *problem[1:])
    expected_end, expected_expansions, way = twin.search(problem[0], swing, *problem[1:])
    assert (end, expansions) == (expected_end, expected_expansions)
    assert actions.tolist() == [node.action for node in way]
    np.testing.assert_array_equal(rows[:, :2], [node.position for node in way])
    np.testing.assert_array_equal(rows[:, 8:16].reshape(-1, 4, 2), [node.feet for node in way])
    np.testing.assert_array_equal(costs, [node.cost for node in way])
    np.testing.assert_array_equal(distances, np.float32([node.distances for node in way]))
    assert len(way) > 1


def all_ways(node, swing, horizon, problem):
    """The last nodes of all sequences of ``horizon`` actions with allowed footholds."""
    if node.depth == horizon:
        return [node]
    steps = twin.children(node, (swing + node.depth) % 2, *problem)
    return list(itertools.chain(*(all_ways(child, swing, horizon, problem) for _, child, allowed in steps if allowed)))


@pytest.mark.parametrize(("horizon", "gap"), [(1, 0.6), (2, 0.62), (3, 0.55), (3, 0.8)])
def test_with_costs_that_add_up_it_finds_the_best_of_all_ways(horizon, gap):
    config = CommandSearchConfig(horizon=horizon, accumulate=True, resolution=0.001, speed_step=0.2, max_expansions=2000)
    search = CommandSearch(sluggish(), config)
    start = standing(0.0, 0.03, 0.1)
    problem = search._problem(start, LEVEL, 0.0, ground([(gap, gap + 0.12)]), GOAL, LINE)
    costs = [node.cost for node in all_ways(twin.Node.of(problem[0]), 0, horizon, problem[1:])]
    *_, found, _ = kernels.search_commands(problem[0], 0, *problem[1:])
    assert len(costs) > 3
    assert found[-1] == pytest.approx(min(costs), abs=2e-3), "but for nodes that are taken for one"


@pytest.mark.parametrize("width", [0.05, 0.15, 0.4, 1.5])
def test_it_finds_a_plan_where_there_is_one(width):
    """Of the last nodes alone, as in the paper: whether there is a plan, and that it is one of all possible ones."""
    config = CommandSearchConfig(horizon=3, resolution=0.001, max_expansions=20_000)
    search = CommandSearch(ideal(), config)
    problem = search._problem(standing(0.3), LEVEL, 0.0, ground([(0.7, 0.7 + width)]), GOAL, LINE)
    end, _, rows, *_ = kernels.search_commands(problem[0], 0, *problem[1:])
    ways = all_ways(twin.Node.of(problem[0]), 0, 3, problem[1:])
    assert (end == kernels.FOUND) == bool(ways)
    if ways:
        assert any(np.allclose(rows[-1, :2], node.position, atol=1e-12) for node in ways)


def test_it_steps_over_a_gap():
    world = ground([(0.8, 0.95)])
    found = plan(standing(), world, horizon=7)
    assert found.kind == PlanKind.FULL and found.stamp == 1.0 and found.id == 4 and not found.reason
    assert found.commands.shape == (7, 2) and found.bases.shape == (8, 2) and found.feet.shape == (8, 4, 3)
    for k in range(7):
        for leg in PAIRS[k % 2]:
            x = found.feet[k + 1, leg, 0]
            assert not 0.8 - 0.02 < x < 0.95 + 0.02, "a foothold within the clearance of the gap"
        for leg in PAIRS[1 - k % 2]:
            np.testing.assert_allclose(found.feet[k + 1, leg], found.feet[k, leg], atol=1e-12)
    assert found.bases[-1, 0] > 0.5
    assert found.clearance >= 0.02


def test_a_gap_that_no_step_crosses_ends_the_search_and_says_so():
    nothing = plan(standing(0.3), ground([(0.7, 1.6)]), horizon=7, min_speed=0.3)
    assert nothing.kind == PlanKind.NONE and not nothing.found
    assert "every way ended without 7 safe steps" in nothing.reason
    limited = plan(standing(), ground(), horizon=7, max_expansions=3)
    assert limited.expansions == 3 and limited.reason.startswith("3 expansions ended without")


def test_a_goal_within_the_horizon_ends_the_plan():
    found = plan(standing(), ground(), goal=np.array([0.3, 0.0]), horizon=7)
    assert found.kind == PlanKind.TO_GOAL
    assert np.abs(found.bases[-1] - [0.3, 0.0]).max() <= 0.1
    assert len(found.commands) < 7


def test_a_step_too_high_is_none():
    assert plan(standing(0.3), ground(step=(0.75, 0.06)), min_speed=0.3).found
    assert not plan(standing(0.3), ground(step=(0.75, 0.09)), min_speed=0.3).found
    climbed = plan(standing(0.3), ground(step=(0.75, 0.06)), min_speed=0.3)
    assert climbed.feet[-1, 0, 2] == pytest.approx(0.06, abs=1e-6)


def test_beside_the_line_commands_lead_back():
    found = plan(standing(0.0, 0.1), ground())
    assert found.commands[0, 1] == pytest.approx(-0.05)
    assert abs(found.bases[-1, 1]) < 0.1
    assert (np.diff(np.abs(found.commands[:, 1])) < 0.0).all()


def test_sideways_actions_reach_what_straight_ones_do_not():
    """Ground for the left feet alone that lies a little to the left."""
    world = ground(holes=np.array([(x, y) for x in np.arange(0.45, 1.6, 0.01) for y in np.arange(0.14, 0.19, 0.01)]))
    assert not plan(standing(), world, min_speed=0.2, clearance=0.05).found
    assert plan(standing(), world, min_speed=0.2, clearance=0.05, sideways=0.2).found


def test_the_outcome_of_a_step_is_what_the_models_say():
    rng = np.random.default_rng(3)
    start, models = random_start(rng), sluggish()
    command = np.array([0.4, 0.05, 0.03])
    expected = models.predict(start.inputs(command), start.swing)
    np.testing.assert_allclose(CommandSearch(models).outcome(start, command), expected, atol=1e-12)


def test_a_slow_walk_is_known_to_cover_less():
    """With a slew limit the base covers what a velocity with a ramp does."""
    search = CommandSearch(ideal(), acceleration=2.0)
    for speed in (0.2, 0.6, 1.0):
        outcome, velocity, way = search.outcome(standing(), np.array([speed, 0.0, 0.0])), 0.0, 0.0
        for _ in range(3000):
            velocity = min(velocity + 2.0 * 1e-4, speed)
            way += velocity * 1e-4
        assert outcome[0] == pytest.approx(way, abs=1e-3)
        assert outcome[6] == pytest.approx(min(speed, 0.6), abs=1e-9)


def test_the_clearest_step_is_the_one_furthest_from_unsafe_ground():
    world = ground([(0.53, 0.9)])
    command, clearance = CommandSearch(ideal()).clearest(standing(), LEVEL, 0.0, world, GOAL, LINE)
    ways = []
    for speed in np.round(np.arange(0.0, 1.05, 0.1), 9):
        x = FEET_B[0, 0] + 0.6 * speed
        ways.append((float(world.at(np.array([[x, 0.2], [-0.35 + 0.6 * speed, -0.2]]))[1].min()), speed))
    assert clearance == pytest.approx(max(ways)[0]) and clearance > 0.0
    assert command[0] in [speed for distance, speed in ways if distance == max(ways)[0]]
    nowhere = ground([(-1.0, 4.0)])
    assert CommandSearch(ideal()).clearest(standing(), LEVEL, 0.0, nowhere, GOAL, LINE)[1] == 0.0


@pytest.mark.parametrize(
    "settings",
    [
        {"horizon": 0},
        {"horizon": 21},
        {"speed_step": 0.0},
        {"min_speed": 0.5, "max_speed": 0.3},
        {"speed_step": 0.01, "sideways": 0.1},
    ],
)
def test_bad_settings_are_refused(settings):
    with pytest.raises(UserInputError):
        CommandSearchConfig(**settings)


def test_nothing_is_commanded_that_no_data_tell_of():
    slow = replace(ideal(), top_speed=0.25)
    assert plan(standing(), ground(), models=slow, preferred_speed=0.6).commands[:, 0].max() == pytest.approx(0.2)
    assert plan(standing(), ground(), models=slow, min_speed=0.5).commands[:, 0].tolist() == [0.5] * 7


def test_actions():
    assert CommandSearchConfig().actions()[:, 0].tolist() == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
    assert CommandSearchConfig(max_speed=0.1, sideways=0.1).actions().tolist() == [
        [0.0, 0.0], [0.0, 0.1], [0.0, -0.1], [0.1, 0.0], [0.1, 0.1], [0.1, -0.1]]  # fmt: skip


def test_the_clearance_of_commands_is_that_of_the_plan_they_come_from():
    world, start = ground([(0.6, 0.7)]), standing()
    search = CommandSearch(sluggish(), CommandSearchConfig())
    question = start, LEVEL, 0.0, world, GOAL, LINE
    found = search.plan(*question, stamp=0.0, id=1)
    assert search.clearance_of(found.commands, *question) == pytest.approx(found.clearance)
    blocked = start, LEVEL, 0.0, ground([(float(found.feet[3, :, 0].max()) - 0.05, 4.0)]), GOAL, LINE
    assert search.clearance_of(found.commands, *blocked) == 0.0 < search.clearance_of(found.commands[:1], *blocked)
