"""The walk with a network: it moves wishes and nothing else, and what follows them stays as safe as it was."""

from dataclasses import replace

import numpy as np
import pytest

import quadpips_drake as qp
from quadpips_drake.baselines.learned_footholds.model_file import save_network
from quadpips_drake.baselines.perceptive_config import PerceptiveReferenceConfig
from quadpips_drake.math.polygons import distance_inside
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.regions import RegionSet
from tests.baselines.hand_made import floor, region
from tests.baselines.learned_footholds.made_up import constant_network
from tests.baselines.test_perceptive_walk import walked
from tests.baselines.test_rivals import leaves


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def learned(directory, offset=(0.0, 0.0), **more):
    """The configuration of a walk with a network that always says ``offset``."""
    save_network(directory, constant_network(offset))
    return PerceptiveReferenceConfig(learned=True, learned_model=str(directory), **more)


def later(memory):
    """The footholds that are not frozen."""
    return [f for f in memory.reference.footholds if f.touchdown_time > memory.reference.stamp + 0.25]


def test_a_network_that_says_nothing_changes_nothing(robot, tmp_path):
    plain, same = (walked(robot, floor(), 0.8, config)[-1] for config in (None, learned(tmp_path)))
    assert len(later(plain)) >= 6
    for one, other in zip(plain.reference.footholds, same.reference.footholds, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=1e-12)


def test_each_foothold_is_moved_ahead_and_outward_and_no_further_than_it_may(robot, tmp_path):
    plain = walked(robot, floor(), 0.2)[-1]
    for offset, most, expected in (((0.06, 0.03), 0.2, (0.06, 0.03)), ((0.3, -0.4), 0.1, (0.06, -0.08))):
        moved = walked(robot, floor(), 0.2, learned(tmp_path, offset, max_offset=most))[-1]
        # The first pair: feet out of place turn the heading of those that follow.
        for one, other in zip(plain.reference.footholds[:2], moved.reference.footholds[:2], strict=True):
            way = (other.position - one.position) * [1.0, other.leg.side, 1.0]
            np.testing.assert_allclose(way, [*expected, 0.0], atol=1e-6)


def test_footholds_still_lie_in_insets_whatever_the_network_says(robot, tmp_path):
    places = [(0.25 * (i - 4), 0.25 * (j - 4), 0.02 * ((i + j) % 3)) for i in range(9) for j in range(9)]
    stones = tuple(region(k, place, (0.2, 0.2)) for k, place in enumerate(places))
    last = walked(robot, RegionSet(0.0, stones), 0.5, learned(tmp_path, (0.11, 0.07)))[-1]
    assert len(last.reference.footholds) >= 8
    for target in last.reference.footholds:
        local = target.region.X_WR[:3, :3].T @ (target.position - target.region.center)
        assert distance_inside(np.array(target.region.inset), *local[:2]) >= -1e-9


def test_without_a_region_near_a_foot_stays_and_is_counted(robot, tmp_path):
    far = RegionSet(0.0, (region(0, (9.0, 0.0, 0.0), (1.0, 1.0)),))
    plain, moved = (walked(robot, far, 0.7, config)[-1] for config in (None, learned(tmp_path, (0.1, 0.1))))
    assert moved.fallbacks == plain.fallbacks > 0
    soles = robot.soles_W(robot.foot_positions_W(standing_state(robot)))
    for target in moved.reference.footholds:
        np.testing.assert_allclose(target.position[:2], soles[target.leg][:2], atol=1e-3)


def test_it_differs_from_s_mpc_in_the_network_alone():
    first, second = (leaves(qp_config(planner)) for planner in ("s_mpc", "lf_mpc"))
    assert {key for key in first if second[key] != first[key]} == {
        ("planner",),
        ("stages", "heuristic", "reference", "learned"),
    }


def qp_config(planner):
    from dataclasses import asdict

    return asdict(qp.load_config(planner=planner))


def test_a_network_of_another_robot_is_refused_when_the_planner_is_built(tmp_path):
    save_network(tmp_path, replace(constant_network(), robot="go2"))
    config = qp.load_config(planner="lf_mpc", sets=(f"stages.heuristic.reference.learned_model={tmp_path}",))
    setup = qp.registries.planners.get("lf_mpc").factory
    with pytest.raises(qp.UserInputError, match="of the robot go2, not anymal_c"):
        from quadpips_drake.diagrams.planners import PlannerSetup

        setup(PlannerSetup(load_robot("anymal_c"), config.stages.heuristic))
