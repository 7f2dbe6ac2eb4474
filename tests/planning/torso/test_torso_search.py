"""Torso search on synthetic regions: where the path leads, and what is said when there is none."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.planning.torso.support_map import ground_penalty, make_support_map
from quadpips_drake.planning.torso.torso_search import TorsoConfig, search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.steppability import Steppability
from tests.planning import worlds

ROBOT = load_robot("anymal_c")
CONFIG = TorsoConfig()
START = np.array([0.0, 0.0, ROBOT.nominal_base_height])


def search(regions, goal, yaw=0.0, start=START):
    return search_torso_path(start, yaw, regions, goal, ROBOT, CONFIG)


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
    there = search(regions, (3.0, 0.0), start=path.poses[-1, :3])
    assert not there.success and "blocked" in there.reason


def test_finds_its_way_from_ground_that_it_does_not_see():
    path = search(worlds.flat_ground((0.7, 3.0)), (2.0, 0.0))
    assert path.success, path.reason
    np.testing.assert_allclose(path.poses[-1, :2], [2.0, 0.0], atol=0.05)


def test_one_large_region_is_enough():
    path = search(RegionSet(0.0, (worlds.patch(0, 1.0, 0.0, 5.0, 3.0),)), (2.5, 0.5))
    assert path.success
    np.testing.assert_allclose(path.poses[-1, :2], [2.5, 0.5], atol=1e-9)


def test_reasons():
    assert "no steppable regions" in search(RegionSet(0.0), (2.0, 0.0)).reason
    label = Steppability.NON_PASSABLE
    walls = worlds.region_set([worlds.patch(0, 1.0, 0.0, 3.0, 2.0, label=label)])
    assert "no steppable regions" in search(walls, (2.0, 0.0)).reason
    assert "within" in search(worlds.flat_ground((20.0, 22.0)), (25.0, 0.0)).reason
    assert "not connected" in search(worlds.flat_ground((3.0, 5.0)), (5.0, 0.0)).reason
    assert "four legs" in search(worlds.flat_ground((-0.1, 0.1), (-0.1, 0.1)), (2.0, 0.0)).reason
    assert "nearer to the goal" in search(worlds.flat_ground((-0.8, 0.3)), (5.0, 0.0)).reason


def test_repeats_to_the_bit():
    first, second = (search(worlds.winding_beam(), (3.5, 2.0)) for _ in range(2))
    assert np.array_equal(first.poses, second.poses)


def test_bad_settings_are_refused():
    with pytest.raises(UserInputError, match="node_spacing"):
        TorsoConfig(node_spacing=0.0)
    with pytest.raises(UserInputError, match="max_edge_yaw"):
        TorsoConfig(yaw_count=6)
