"""Torso search on synthetic regions: where the path leads, and what is said when there is none."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.planning.torso.gaps import widest_gap
from quadpips_drake.planning.torso.subgoals import Exploration
from quadpips_drake.planning.torso.support_map import ground_penalty, make_support_map
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.steppability import Steppability
from tests.planning import worlds
from tests.planning.probe import planning_config, walk
from tests.planning.probe_worlds import WORLDS

ROBOT = load_robot("anymal_c")
CONFIG = TorsoConfig()
START = np.array([0.0, 0.0, ROBOT.nominal_base_height])


def search(regions, goal, yaw=0.0, start=START, **more):
    return search_torso_path(start, yaw, regions, goal, ROBOT, CONFIG, **more)


def assert_supported(path, regions):
    """Every pose but the first has ground for all four legs."""
    support = make_support_map(regions.regions)
    ground = path.poses[1:, 2] - ROBOT.nominal_base_height
    assert np.isfinite(ground_penalty(support, path.poses[1:][:, [0, 1, 3]], ground, ROBOT, CONFIG)).all()


def test_walks_straight_to_a_goal_on_flat_ground():
    path = search(worlds.flat_ground(), (2.3, 0.0))
    assert path.success and path.reason == ""
    np.testing.assert_allclose(path.poses[0], [*START, 0.0])
    np.testing.assert_allclose(path.poses[-1, :2], [2.3, 0.0], atol=1e-9)
    assert np.abs(path.poses[:, 1]).max() < 0.05 and np.abs(path.poses[:, 3]).max() < 0.1
    np.testing.assert_allclose(path.poses[:, 2], START[2], atol=1e-6)
    assert np.linalg.norm(np.diff(path.poses[:, :2], axis=0), axis=1).max() <= CONFIG.pose_spacing + 0.06


def test_faces_along_the_path():
    path = search(worlds.flat_ground(), (1.6, 0.6))
    assert path.poses[-1, 3] == pytest.approx(np.arctan2(0.6, 1.6), abs=0.3)


def test_turns_round_for_a_goal_behind():
    path = search(worlds.flat_ground((-3.0, 0.8)), (-2.2, 0.0))
    assert abs(path.poses[-1, 3]) > 2.6
    assert np.abs(np.diff(np.unwrap(path.poses[:, 3]))).max() < 0.5


def test_goal_beyond_what_is_seen_ends_at_the_frontier_heading_for_it():
    path = search(worlds.flat_ground((-0.8, 2.0)), (8.0, 0.0))
    assert path.success
    assert 1.2 < path.poses[-1, 0] < 2.0  # all legs still find ground
    assert abs(path.poses[-1, 3]) < 0.2


@pytest.mark.parametrize("make", [worlds.stepping_stones, worlds.stairs, worlds.ramp, worlds.winding_beam])
def test_follows_the_ground(make):
    regions = make()
    far = max((region.center for region in regions.regions), key=lambda center: center[0])
    goal = (far[0] - 0.5, 2.0 if make is worlds.winding_beam else 0.0)
    path = search(regions, goal)
    assert path.success, path.reason
    np.testing.assert_allclose(path.poses[-1, :2], goal, atol=0.05)
    assert_supported(path, regions)


def test_stops_at_a_pit_and_then_says_that_the_way_is_blocked():
    regions = worlds.pit(1.2)
    path = search(regions, (3.0, 0.0))
    assert path.success and path.poses[-1, 0] < 0.7
    assert_supported(path, regions)
    plans, exploration = 0, Exploration()
    while path.success:  # it looks about, but not for ever
        x, y, _, yaw = path.poses[-1]
        exploration = exploration.after(path).standing_at((x, y, yaw), (3.0, 0.0))
        path = search_torso_path(
            path.poses[-1, :3], yaw, regions, np.array([3.0, 0.0]), ROBOT, CONFIG, exploration=exploration
        )
        plans += 1
    assert plans <= CONFIG.max_detour + 3 and "blocked" in path.reason


def test_names_the_gap_before_an_island():
    regions = worlds.pit(1.2)
    position = np.array([[0.2, 0.0, ROBOT.nominal_base_height]])
    width, middle = widest_gap(make_support_map(regions.regions), position, np.array([2.4, 0.0]))
    assert width == pytest.approx(1.2, abs=0.15) and middle[0] == pytest.approx(1.3, abs=0.3)
    assert widest_gap(make_support_map(worlds.flat_ground().regions), position, np.array([2.0, 0.0])) is None


def test_rather_goes_about_a_gap_than_over_it_where_legs_find_no_ground_half_way():
    robot, config = load_robot("go2"), planning_config("go2").torso
    banks = (worlds.tiles((-0.8, 0.7), (-0.9, 0.9)), worlds.tiles((1.12, 2.6), (-0.9, 0.9)))
    regions = worlds.region_set(*banks, worlds.tiles((0.7, 1.12), (0.1, 0.9)))
    start = np.array([0.0, -0.4, robot.nominal_base_height])

    def aside(bridge_cost):
        path = search_torso_path(start, 0.0, regions, (2.0, -0.4), robot, replace(config, bridge_cost=bridge_cost))
        assert path.success and path.to_goal, path.reason
        return path.poses[:, 1].max()

    assert aside(0.0) < -0.3  # there is a stance on either side of the gap
    assert aside(1.0) > 0.1


def test_goes_about_a_pit_by_a_beam_that_leads_away_from_the_goal():
    report = walk(WORLDS["detour"](1.6), ROBOT, planning_config("anymal_c"), max_plans=20)
    assert report.reached and not report.failures


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_reaches_goals_all_round_with_a_camera_in_front(name):
    for degrees in (180, 90, -120):
        report = walk(WORLDS["flat"](degrees, 1.0), load_robot(name), planning_config(name), camera=True, max_plans=16)
        assert report.reached, (degrees, report.failures)


def test_another_goal_begins_anew():
    exploration = Exploration().standing_at((0.0, 0.0, 0.0), (2.0, 0.0)).standing_at((1.0, 0.0, 0.0), (2.0, 0.0))
    assert len(exploration.viewpoints) == 2 and exploration.detour == 0
    assert exploration.standing_at((0.5, 0.0, 0.0), (2.0, 0.1)).detour == 1
    assert len(exploration.standing_at((1.0, 0.0, 0.0), (0.0, 2.0)).viewpoints) == 1


def test_a_sub_goal_that_failed_from_here_is_not_the_next_one():
    regions, goal, start = worlds.pit(1.2), (3.0, 0.0), (0.5, 0.0, 0.0)
    ends, exploration, failed = [], Exploration(), None
    for _ in range(3):
        exploration = exploration.standing_at(start, goal, failed)
        p_WB = np.array([*start[:2], ROBOT.nominal_base_height])
        path = search_torso_path(p_WB, start[2], regions, np.array(goal), ROBOT, CONFIG, exploration=exploration)
        exploration, failed = exploration.after(path), path.poses
        ends.append(path.poses[-1, [0, 1, 3]])
    assert len(exploration.in_vain) == 2
    assert min(np.abs(ends[i] - ends[j]).max() for i in range(3) for j in range(i)) > 0.1
    assert not len(exploration.standing_at((0.1, 0.0, 0.0), goal).in_vain)  # it has walked since


def test_finds_its_way_from_ground_that_it_does_not_see():
    path = search(worlds.flat_ground((0.7, 3.0)), (2.0, 0.0))
    assert path.success, path.reason
    np.testing.assert_allclose(path.poses[-1, :2], [2.0, 0.0], atol=0.05)


def test_one_large_region_is_enough():
    path = search(RegionSet(0.0, (worlds.patch(0, 1.0, 0.0, 5.0, 3.0),)), (2.5, 0.5))
    assert path.success
    np.testing.assert_allclose(path.poses[-1, :2], [2.5, 0.5], atol=1e-9)


def test_ground_of_every_label_if_asked_for():
    label = Steppability.NON_PASSABLE
    walls = worlds.region_set([worlds.patch(0, 1.0, 0.0, 5.0, 3.0, label=label)])
    assert not search(walls, (2.0, 0.0)).success
    assert search(walls, (2.0, 0.0), every_label=True).to_goal


def test_reasons():
    assert "no steppable regions" in search(RegionSet(0.0), (2.0, 0.0)).reason
    label = Steppability.NON_PASSABLE
    walls = worlds.region_set([worlds.patch(0, 1.0, 0.0, 3.0, 2.0, label=label)])
    assert "no steppable regions" in search(walls, (2.0, 0.0)).reason
    assert "within" in search(worlds.flat_ground((20.0, 22.0)), (25.0, 0.0)).reason
    assert "not connected" in search(worlds.flat_ground((3.0, 5.0)), (5.0, 0.0)).reason
    assert "four legs" in search(worlds.flat_ground((-0.1, 0.1), (-0.1, 0.1)), (2.0, 0.0)).reason
    looks_about = search(worlds.flat_ground((-0.8, 0.3)), (5.0, 0.0))
    assert looks_about.success and not looks_about.to_goal


def test_repeats_to_the_bit():
    first, second = (search(worlds.winding_beam(), (3.5, 2.0)) for _ in range(2))
    assert np.array_equal(first.poses, second.poses)


def test_bad_settings_are_refused():
    with pytest.raises(UserInputError, match="node_spacing"):
        TorsoConfig(node_spacing=0.0)
    with pytest.raises(UserInputError, match="max_edge_yaw"):
        TorsoConfig(yaw_count=6)


@pytest.mark.parametrize(("name", "distance"), [("anymal_c", 1.5), ("go2", 1.2)])
def test_looks_where_it_goes_before_it_sets_out(name, distance):
    robot, config = load_robot(name), planning_config(name).torso
    stands_on = worlds.flat_ground((-0.75, 0.7), (-0.5, 0.5))  # and the goal lies where a camera in front shows nothing
    goal, here = np.array([0.0, distance]), np.array([0.0, 0.0, robot.nominal_base_height])
    turn = search_torso_path(here, 0.0, stands_on, goal, robot, config)
    assert np.hypot(*turn.poses[-1, :2]) < 0.05 and turn.poses[-1, 3] == pytest.approx(np.pi / 2, abs=0.1)
    ahead = search_torso_path(here, 1.2, stands_on, goal, robot, config)
    assert np.hypot(*ahead.poses[-1, :2]) > 0.2, "it faces the goal"
    exploration = Exploration().standing_at((0.0, -0.5, np.pi / 2), goal).standing_at((0.0, 0.0, 0.0), goal)
    on = search_torso_path(here, 0.0, stands_on, goal, robot, config, exploration=exploration)
    assert np.hypot(*on.poses[-1, :2]) > 0.2, "it is on its way"


def test_steps_back_to_see_what_is_too_near_before_it_gives_up():
    robot, config = load_robot("go2"), planning_config("go2").torso
    strip = (worlds.tiles((-0.7, 0.7), (-0.5, 0.5)), worlds.tiles((-0.7, 0.7), (0.95, 1.6)))  # between them nobody looked
    regions, goal = worlds.region_set(*strip), np.array([0.0, 1.2])
    pose = (0.0, 0.3, np.pi / 2)
    p_WB = np.array([*pose[:2], robot.nominal_base_height])
    exploration = Exploration().standing_at((0.0, 0.0, 0.0), goal).standing_at(pose, goal)
    again = search_torso_path(p_WB, pose[2], regions, goal, robot, config, exploration=exploration)
    assert again.poses[-1, 1] > 0.5
    tried = exploration.standing_at(pose, goal, again.poses)
    tired = search_torso_path(p_WB, pose[2], regions, goal, robot, config, exploration=tried, level=3)
    assert tired.poses[-1, 1] > 0.5
    back = search_torso_path(p_WB, pose[2], regions, goal, robot, config, exploration=tried, level=4)
    x, y, yaw = back.poses[-1, [0, 1, 3]]
    assert not back.to_goal and y < 0.45
    hidden = np.array([[i, 0.85] for i in (-0.5, -0.25, 0.0, 0.25, 0.5)]) - [x, y]
    ahead, aside = hidden @ [np.cos(yaw), np.sin(yaw)], np.abs(hidden @ [-np.sin(yaw), np.cos(yaw)])
    assert ((ahead > config.view_near) & (aside < ahead)).any()
    first = exploration.standing_at(pose, goal)  # it has walked since
    assert search_torso_path(p_WB, pose[2], regions, goal, robot, config, exploration=first, level=4).poses[-1, 1] > 0.5
