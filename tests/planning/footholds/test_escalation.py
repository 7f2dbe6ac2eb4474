"""After failures the search is another one, and what the legs allow is never exceeded."""

import dataclasses

from quadpips_drake.planning.footholds.escalation import LEVELS, escalated
from quadpips_drake.planning.footholds.foothold_config import MAX_EXPANSIONS, FootholdConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from tests.planning.probe import planning_config, walk
from tests.planning.probe_worlds import WORLDS

CONFIG = FootholdConfig()


def test_no_two_levels_are_alike():
    levels = [escalated(CONFIG, level) for level in range(len(LEVELS))]
    assert levels[0] is CONFIG
    assert all(levels[i] != levels[j] for i in range(len(levels)) for j in range(i))
    assert escalated(CONFIG, 99) == levels[-1] and escalated(CONFIG, -1) is CONFIG


def test_single_swings_are_more_and_lead_less_far():
    careful = escalated(CONFIG, 1)
    assert careful.gait == CONFIG.careful_gait
    assert careful.max_steps > CONFIG.max_steps and careful.local_radius < CONFIG.local_radius
    assert escalated(dataclasses.replace(CONFIG, max_steps=32), 1).max_steps == 32


def test_expansions_stay_in_range():
    large = dataclasses.replace(CONFIG, max_expansions=MAX_EXPANSIONS)
    assert escalated(large, 3).max_expansions == MAX_EXPANSIONS


def test_a_trench_that_needs_wider_limits_is_crossed():
    report = walk(WORLDS["trench"](0.45), load_robot("anymal_c"), planning_config("anymal_c"), max_plans=12)
    assert report.reached and report.failures


def test_the_go2_crosses_sparse_stones_with_swings_in_any_order():
    """With the pairs of its trot alone it turns round between stones that single swings lead across (17 plans and more)."""
    report = walk(
        load_terrain("sparse_stones", seed=9), load_robot("go2"), planning_config("go2"), camera=True, max_plans=10
    )
    assert report.reached and not report.failures
