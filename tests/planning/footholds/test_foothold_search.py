"""Foothold search on synthetic regions: every constraint of every stance, bounds, reasons."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.gaits.swing_gaits import swing_gait, swing_gait_names
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.footholds.refused_swings import are_refused
from quadpips_drake.planning.footholds.stance_rules import REJECTIONS
from quadpips_drake.planning.region_table import in_convex_polygon
from quadpips_drake.planning.start_stance import attach_feet, start_ground, with_region
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.leg_shapes import leg_gap
from quadpips_drake.robots.reachability import leg_chains
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.stance_limits import stance_limits
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import RefusedSwing, RefusedSwings, TorsoPath
from quadpips_drake.values.regions import RegionSet
from tests.planning import worlds

ROBOT = load_robot("anymal_c")
NOMINAL = ROBOT.nominal_footholds_B
NEIGHBOURS = ((Leg.LF, Leg.RF), (Leg.LH, Leg.RH), (Leg.LF, Leg.LH), (Leg.RF, Leg.RH))
GO2_FEET = {
    "reach_offset": [0.0, 0.01, 0.03],
    "reach_semi_axes": [0.26, 0.15, 0.17],
    "max_swing": 0.30,
    "length_tolerance": 0.22,
    "preferred_swing": 0.18,
}
WORLDS = {
    "flat": (worlds.flat_ground(), (2.3, 0.0)),
    "stepping_stones": (worlds.stepping_stones(), (3.2, 0.0)),
    "stairs": (worlds.stairs(), (3.2, 0.0)),
    "ramp": (worlds.ramp(), (2.5, 0.0)),
    "gap": (worlds.pit(0.30), (2.3, 0.0)),
    "beam": (worlds.beam(0.25), (3.2, 0.0)),
    "winding_beam": (worlds.winding_beam(), (3.6, 2.0)),
}


def plan_once(regions, goal, config=None, state=None, robot=ROBOT, refused=None, **more):
    state = worlds.standing_state(robot) if state is None else state
    path = search_torso_path(state.p_WB, state.rpy_WB[2], regions, goal, robot, TorsoConfig(), request_id=7)
    return search_footholds(state, regions, path, robot, config or FootholdConfig(), refused, **more)


def assert_valid(plan, config, robot=ROBOT):
    """Holds every stance and swing of a plan against the constraints of section VI-C, computed another way."""
    nominal = robot.nominal_footholds_B
    for k, stance in enumerate(plan.stances):
        for leg in Leg:
            region, point = stance.regions[leg], stance.footholds[leg]
            local = region.X_WR[:3, :3].T @ (point - region.center)
            if k > 0 and region.id >= 0:
                assert abs(local[2]) < 1e-6 or np.array_equal(point, plan.stances[0].footholds[leg])
                assert in_convex_polygon(local[:2], region.boundary, 1e-9), "a foothold in the void"
            np.testing.assert_allclose(stance.normals[leg], region.normal)
        if k > 0:
            assert_good_stance(stance, nominal, config, robot)
    for legs, before, after in zip(plan.swing_legs, plan.stances[:-1], plan.stances[1:], strict=True):
        moved = np.linalg.norm(after.footholds - before.footholds, axis=1)
        assert moved.max() <= config.max_swing + 1e-9  # eq. 18
        assert all(moved[leg] == 0.0 for leg in Leg if leg not in legs)


def assert_good_stance(stance, nominal, config, robot):
    """Separation, eqs. 16-17, inverse kinematics."""
    distances = np.linalg.norm(stance.footholds[:, None] - stance.footholds[None], axis=2)
    assert distances[np.triu_indices(4, 1)].min() >= 2 * robot.foot_radius + robot.leg_clearance
    limits = stance_limits(robot)
    roll, pitch, yaw = stance.rpy_WB
    Rx = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    Ry = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    Rz = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    R_WB = Rz @ Ry @ Rx
    local = (stance.footholds - stance.p_WB) @ R_WB
    for left, right in ((Leg.LF, Leg.RF), (Leg.LH, Leg.RH)):
        assert limits.min_width <= local[left, 1] - local[right, 1] <= limits.max_width
    for fore, hind in ((Leg.LF, Leg.LH), (Leg.RF, Leg.RH)):
        ideal = nominal[fore, 0] - nominal[hind, 0]
        assert abs(local[fore, 0] - local[hind, 0] - ideal) < config.length_tolerance
    centers = (stance.footholds + robot.foot_radius * stance.normals - stance.p_WB) @ R_WB
    assert all(robot.leg_inverse_kinematics_B(leg, centers[leg])[1] for leg in Leg)
    gaps = [leg_gap(int(i), centers[i], int(j), centers[j], leg_chains(robot), robot.leg_shapes) for i, j in NEIGHBOURS]
    assert min(gaps) >= robot.leg_clearance


@pytest.mark.parametrize("gait", swing_gait_names())
@pytest.mark.parametrize("name", WORLDS)
def test_every_stance_keeps_the_constraints(name, gait):
    config = FootholdConfig(gait=gait, careful_gait=gait)
    plan = plan_once(*WORLDS[name], config)
    assert plan.success, plan.reason
    assert plan.request_id == 7 and plan.gait == gait and plan.swing_duration == swing_gait(gait).swing_duration
    assert 1 <= len(plan.swing_legs) <= config.max_steps and len(plan.stances) == len(plan.swing_legs) + 1
    assert_valid(plan, config)


@pytest.mark.parametrize("name", WORLDS)
def test_plan_after_plan_leads_to_the_goal(name):
    regions, goal = WORLDS[name]
    plans, state = worlds.walk(ROBOT, regions, np.array(goal), TorsoConfig(), FootholdConfig(), max_plans=14)
    assert all(plan.success for plan in plans), plans[-1].reason
    assert np.hypot(*(state.p_WB[:2] - goal)) < 0.2


def test_go2_walks_on_flat_ground():
    robot = load_robot("go2")
    config = FootholdConfig(**GO2_FEET)
    plan = plan_once(worlds.flat_ground(), (2.3, 0.0), config, robot=robot)
    assert plan.success, plan.reason
    assert plan.stances[-1].p_WB[0] > 0.5
    assert_valid(plan, config, robot)


def test_gait_phases_follow_each_other():
    for gait in ("standing_trot", "standing_walk"):
        plan = plan_once(*WORLDS["flat"], FootholdConfig(gait=gait))
        phases = swing_gait(gait).phases
        order = [phases.index(legs) for legs in plan.swing_legs]
        assert all((b - a) % len(phases) == 1 for a, b in pairwise(order))
    plan = plan_once(*WORLDS["flat"], FootholdConfig(any_first_phase=False))
    assert plan.swing_legs[0] == (Leg.RF, Leg.LH)


@pytest.mark.parametrize("name", WORLDS)
def test_in_any_order_pairs_and_single_legs_swing(name):
    config = FootholdConfig(any_order=True)
    plan = plan_once(*WORLDS[name], config)
    assert plan.success, plan.reason
    assert set(plan.swing_legs) <= {*swing_gait("standing_trot").phases, *swing_gait("standing_walk").phases}
    assert_valid(plan, config)


@pytest.mark.parametrize("leg", Leg)
@pytest.mark.parametrize("config", [FootholdConfig(), FootholdConfig(any_order=True), FootholdConfig(any_first_phase=False)])
def test_a_foot_that_hangs_in_the_air_swings_first(config, leg):
    contacts = np.ones(4, dtype=bool)
    contacts[leg] = False
    plan = plan_once(*WORLDS["flat"], config, state=replace(worlds.standing_state(ROBOT), contacts=contacts))
    assert plan.success and leg in plan.swing_legs[0]


def test_ends_in_a_stance_near_the_nominal_one():
    for name in ("flat", "stairs", "stepping_stones"):
        last = plan_once(*WORLDS[name]).stances[-1]
        c, s = np.cos(last.rpy_WB[2]), np.sin(last.rpy_WB[2])
        local = (last.footholds - last.p_WB)[:, :2] @ np.array([[c, -s], [s, c]])
        assert np.linalg.norm(local - NOMINAL[:, :2], axis=1).max() < 0.13, name


def test_goal_within_reach_is_the_waypoint():
    plan = plan_once(worlds.flat_ground(), (0.8, 0.1))
    np.testing.assert_allclose(plan.waypoint[:2], [0.8, 0.1])
    assert plan.complete
    assert np.hypot(*(plan.stances[-1].p_WB[:2] - [0.8, 0.1])) <= FootholdConfig().goal_tolerance


def test_one_large_region_carries_all_feet():
    regions = RegionSet(0.0, (worlds.patch(0, 1.0, 0.0, 5.0, 3.0),))
    plan = plan_once(regions, (3.0, 0.5))
    assert plan.success and plan.complete
    assert_valid(plan, FootholdConfig())


def test_centers_as_in_the_paper():
    config = FootholdConfig(candidate="center")
    plan = plan_once(worlds.flat_ground(), (2.3, 0.0), config)
    assert plan.success, plan.reason
    assert_valid(plan, config)
    start = plan.stances[0].footholds
    for stance in plan.stances[1:]:
        for leg in Leg:
            if not np.array_equal(stance.footholds[leg], start[leg]):
                np.testing.assert_allclose(stance.footholds[leg], stance.regions[leg].center)


def test_starts_from_ground_that_it_does_not_see():
    state = worlds.standing_state(ROBOT)
    seen = worlds.flat_ground((0.7, 3.0))
    assert not any(attachment.perceived for attachment in attach_feet(state, seen.regions, ROBOT))
    regions = with_region(seen, start_ground(state, ROBOT, 0.10))
    assert all(attachment.perceived for attachment in attach_feet(state, regions.regions, ROBOT))
    config = FootholdConfig()
    plans, end = worlds.walk(ROBOT, regions, np.array([2.2, 0.0]), TorsoConfig(), config, max_plans=6)
    assert all(plan.success for plan in plans), plans[-1].reason
    assert np.hypot(*(end.p_WB[:2] - [2.2, 0.0])) < 0.2
    for plan in plans:
        assert_valid(plan, config)


def test_a_foot_without_ground_gets_a_recorded_patch():
    regions = worlds.flat_ground((-0.8, 0.2))  # nothing under the fore feet
    state = worlds.standing_state(ROBOT)
    perceived = [attachment.perceived for attachment in attach_feet(state, regions.regions, ROBOT)]
    assert perceived == [False, False, True, True]
    raised = worlds.standing_state(ROBOT, z=0.10)
    assert not any(attachment.perceived for attachment in attach_feet(raised, regions.regions, ROBOT))
    plan = plan_once(worlds.flat_ground((0.2, 3.0)), (2.0, 0.0))
    assert plan.success, plan.reason
    assert [region.id < 0 for region in plan.stances[0].regions] == [False, False, True, True]


def test_expansions_are_bounded():
    regions, goal = worlds.pit(0.36), (2.3, 0.0)
    for bound in (1, 20):
        config = FootholdConfig(max_expansions=bound, waypoint_retries=2)
        plan = plan_once(regions, goal, config)
        assert plan.expansions <= 3 * bound
    plan = plan_once(*WORLDS["flat"], FootholdConfig(max_expansions=1, waypoint_retries=0, min_progress=0.5))
    assert not plan.success and "bound of 1 expansions" in plan.reason


def test_a_search_without_progress_ends_early():
    """The waypoint is beyond a pit."""
    regions, goal = worlds.pit(0.7), (2.3, 0.0)
    patient, hasty = (
        plan_once(regions, goal, FootholdConfig(patience=patience, waypoint_retries=0)) for patience in (1.0, 0.2)
    )
    assert hasty.expansions < 0.7 * patient.expansions
    assert "in vain" in hasty.reason or hasty.success
    ends = [plan.stances[-1].p_WB[0] if plan.success else 0.0 for plan in (patient, hasty)]
    assert ends[1] > ends[0] - 0.15


@pytest.mark.parametrize(("single_place", "bounded"), [(0.0, True), (0.10, False)])
def test_small_stones_as_single_places_are_all_tried_within_the_bound(single_place, bounded):
    robot = load_robot("go2")
    stones = [worlds.patch(0, x, y, 0.15, 0.15, margin=0.02) for x in (-0.2, 0.2) for y in (-0.15, 0.15)]
    regions = worlds.region_set(stones, worlds.tiles((1.2, 2.0), (-0.4, 0.4)))  # out of reach
    poses = np.array([[x, 0.0, robot.nominal_base_height, 0.0] for x in np.linspace(0.0, 0.8, 9)])
    config = FootholdConfig(**GO2_FEET, single_place=single_place, waypoint_retries=0, patience=1.0)
    plan = search_footholds(worlds.standing_state(robot), regions, TorsoPath(0.0, 1, poses, regions), robot, config)
    assert not plan.success
    assert ("bound" in plan.reason) == bounded, plan.reason


def test_time_limit_is_reported():
    plan = plan_once(*WORLDS["flat"], FootholdConfig(time_limit=1e-9, waypoint_retries=0))
    assert plan.time_limit_hit and not plan.success and "time limit" in plan.reason
    assert not plan_once(*WORLDS["flat"]).time_limit_hit


def test_says_why_nothing_was_found():
    state = worlds.standing_state(ROBOT)
    nothing = search_torso_path(state.p_WB, 0.0, RegionSet(0.0), (2.0, 0.0), ROBOT, TorsoConfig())
    plan = search_footholds(state, RegionSet(0.0), nothing, ROBOT, FootholdConfig())
    assert not plan.success and plan.reason == nothing.reason
    path = search_torso_path(state.p_WB, 0.0, worlds.flat_ground(), (2.0, 0.0), ROBOT, TorsoConfig())
    plan = search_footholds(state, RegionSet(0.0), path, ROBOT, FootholdConfig())
    assert not plan.success and plan.stances == () and plan.reason


def test_counts_what_each_constraint_refused():
    plan = plan_once(*WORLDS["stepping_stones"])
    assert plan.success and set(plan.refusals) <= set(REJECTIONS)
    assert 0 < sum(plan.refusals.values()) < plan.considered
    state = worlds.standing_state(ROBOT, x=0.3)
    config = FootholdConfig(waypoint_retries=0, min_progress=2.0, max_swing=0.2)
    plan = plan_once(worlds.pit(0.36), (2.3, 0.0), config, state)
    worst = max(plan.refusals, key=plan.refusals.get)
    share = f"{100.0 * plan.refusals[worst] / plan.considered:.0f} % of {plan.considered} stances refused: {worst}"
    assert not plan.success and share in plan.reason


def test_repeats_to_the_bit():
    first, second = (plan_once(*WORLDS["stepping_stones"]) for _ in range(2))
    assert first.swing_legs == second.swing_legs and first.expansions == second.expansions
    for a, b in zip(first.stances, second.stances, strict=True):
        assert np.array_equal(a.footholds, b.footholds) and np.array_equal(a.p_WB, b.p_WB)


def test_bad_settings_are_refused():
    with pytest.raises(UserInputError, match="standing_trot"):
        FootholdConfig(gait="gallop")
    with pytest.raises(UserInputError, match="nearest"):
        FootholdConfig(candidate="best")
    with pytest.raises(UserInputError, match="must have 3 items, not 1"):
        FootholdConfig(reach_semi_axes=[1.0])


def test_a_refused_swing_is_not_planned_again_and_the_search_goes_around_it():
    regions, goal = WORLDS["stepping_stones"]
    first, refused = plan_once(regions, goal), []
    for _ in range(3):
        plan = plan_once(regions, goal, refused=RefusedSwings(1, tuple(refused)))
        assert plan.success and plan.complete == first.complete
        for swing in refused:
            for legs, before, after in zip(plan.swing_legs, plan.stances[:-1], plan.stances[1:], strict=True):
                same_start = np.abs(before.footholds - swing.start).max() < 0.01
                assert not (same_start and legs == swing.legs and np.abs(after.footholds - swing.end).max() < 0.02)
        refused.append(RefusedSwing(plan.swing_legs[0], plan.stances[0].footholds, plan.stances[1].footholds))


def test_a_swing_is_refused_for_these_legs_from_this_stance_only():
    start, end = np.zeros((4, 3)), np.zeros((4, 3))
    end[Leg.LF] = [0.2, 0.0, 0.0]
    near, far = end + np.array([0.02, 0.0, 0.0]), end + np.array([0.05, 0.0, 0.0])
    swing = RefusedSwing((Leg.LF,), start, end)
    ends = np.array([end, near, far])
    np.testing.assert_array_equal(are_refused((swing,), (Leg.LF,), start + 0.005, ends), [True, True, False])
    assert not are_refused((swing,), (Leg.RF,), start, ends).any()
    assert not are_refused((swing,), (Leg.LF,), start + 0.05, ends).any()


def test_feet_that_would_hit_something_on_their_way_go_another_one():
    """Here: no foot gets over the line x = 0.62 m from the 12 cm before it, where it would often step otherwise."""
    regions, goal, asked = WORLDS["flat"][0], (1.4, 0.0), []

    def is_stuck(start, end):
        return 0.50 < start[0] < 0.62 < end[0]

    def clears(duration, start, end):
        asked.append((*start[0], *end[0]))
        return not is_stuck(start[0], end[0])

    def stuck_swings(plan):
        steps = zip(plan.swing_legs, plan.stances[:-1], plan.stances[1:], strict=True)
        return sum(is_stuck(a.footholds[leg], b.footholds[leg]) for legs, a, b in steps for leg in legs)

    free, plan = plan_once(regions, goal), plan_once(regions, goal, clears=clears)
    assert stuck_swings(free) > 0, "the test needs a line that is in the way"
    assert plan.success and stuck_swings(plan) == 0
    assert len(asked) < 40 * plan.expansions, "few swings are looked at"
    assert abs(plan.stances[-1].p_WB[0] - free.stances[-1].p_WB[0]) < 0.1, "the plan leads as far"


def test_nothing_leads_over_a_wall():
    def clears(duration, start, end):
        return end[0][0] < 0.62

    plan = plan_once(*WORLDS["flat"], clears=clears)
    assert all((stance.footholds[:, 0] < 0.62).all() for stance in plan.stances)
