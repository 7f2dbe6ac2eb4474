"""Room for the torso: walls and high things on hand-made maps."""

import numpy as np
import pytest

from quadpips_drake.planning.torso.support_map import ground_penalty, make_support_map
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_room import HighGround, TorsoRoom, body_corners
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.regions import GroundHeights
from tests.planning import worlds

ROBOTS = {name: load_robot(name) for name in ("anymal_c", "go2")}
ROBOT, CONFIG = ROBOTS["anymal_c"], TorsoConfig()
START = np.array([0.0, 0.0, ROBOT.nominal_base_height])
CELL = 0.01
SLOPE = 0.5


def heights(surface) -> GroundHeights:
    """A map of 6 x 6 m about (1, 0); ``surface``: heights at x, y (n, n) each."""
    middles = -3.0 + CELL * (np.arange(600) + 0.5)
    x, y = np.meshgrid(middles + 1.0, middles, indexing="ij")
    return GroundHeights(0.0, np.array([-2.0, -3.0]), CELL, surface(x, y).astype(np.float32))


def face(at: float, height: float = 0.6, left: float = 9.0, right: float = -9.0) -> GroundHeights:
    """What a camera knows of a wall: a line of one or two cells."""
    return heights(lambda x, y: np.where((abs(x - at) < 0.7 * CELL) & (right < y) & (y < left), height, 0.0))


def penalty(known: GroundHeights, *poses, robot=ROBOT) -> list[float]:
    support = make_support_map(worlds.flat_ground().regions, heights=known)
    return ground_penalty(support, np.array(poses, float), np.zeros(len(poses)), robot, CONFIG).tolist()


def test_a_pose_is_left_out_where_something_reaches_up_to_its_belly():
    nose = body_corners(ROBOT)[1, 0] + CONFIG.body_margin
    before, at, beyond = ((x, 0.0, 0.0) for x in (1.2 - nose - 0.05, 1.2 - nose + 0.05, 1.2))
    assert np.isfinite(penalty(face(1.2), before))
    assert penalty(face(1.2), at, beyond) == [np.inf, np.inf]
    assert np.isfinite(penalty(face(1.2, 0.3), at, beyond)).all(), "the torso passes above it"
    assert np.isfinite(penalty(GroundHeights.empty(), at, beyond)).all(), "nothing is known of it"
    assert np.isfinite(penalty(face(1.2), (0.75, 0.0, np.pi / 2))), "alongside"


@pytest.mark.parametrize("name", ROBOTS)
def test_a_steep_ramp_is_not_in_the_way(name):
    robot = ROBOTS[name]
    known = heights(lambda x, y: np.tan(SLOPE) * x)
    support = make_support_map([worlds.patch(0, 0.0, 0.0, 6.0, 4.0, slope=SLOPE)], heights=known)
    poses = np.array([[x, 0.0, yaw] for x in (0.0, 0.8) for yaw in (0.0, 0.8, 1.6, 3.1)])
    assert np.isfinite(ground_penalty(support, poses, np.tan(SLOPE) * poses[:, 0], robot, CONFIG)).all()


def test_high_ground_is_the_highest_in_each_cell_of_the_raster():
    rng = np.random.default_rng(0)
    values = rng.uniform(-1.0, 1.0, (120, 90)).astype(np.float32)
    values[rng.uniform(size=values.shape) < 0.3] = np.nan
    values[40:80, 20:60] = np.nan
    known, origin, resolution = GroundHeights(0.0, np.array([0.013, -0.2]), CELL, values), np.array([0.1, -0.5]), 0.04
    top = HighGround.over(known, origin, resolution, (40, 20)).top
    expected = np.full((40, 20), -np.inf, np.float32)
    for i, j in np.argwhere(np.isfinite(values)):
        ix, iy = np.rint((known.corner + CELL * (np.array([i, j]) + 0.5) - origin) / resolution).astype(int)
        if 0 <= ix < 20 and 0 <= iy < 40:
            expected[iy, ix] = max(expected[iy, ix], values[i, j])
    unseen, reach = np.argwhere(np.isneginf(expected)), 13  # cells of 0.04 m in 0.5 m
    around = [expected[max(iy - reach, 0) : iy + reach + 1, max(ix - reach, 0) : ix + reach + 1].max() for iy, ix in unseen]
    expected[tuple(unseen.T)] = around
    assert len(unseen) > 50
    np.testing.assert_array_equal(top, expected)
    assert HighGround.over(known, np.array([9.0, 9.0]), resolution, (4, 4)) is None


def test_a_path_goes_round_a_wall_or_ends_before_it():
    def search(known):
        return search_torso_path(
            START, 0.0, worlds.flat_ground((-1.5, 3.5), (-1.8, 1.8)), (2.6, 0.0), ROBOT, CONFIG, heights=known
        )

    straight, round_it = search(None), search(face(1.2, left=0.5))
    assert straight.to_goal and np.abs(straight.poses[:, 1]).max() < 0.1
    assert round_it.to_goal
    through = round_it.poses[np.abs(round_it.poses[:, 0] - 1.2) < 0.3]
    assert len(through) and (through[:, 1] > 0.5 + 0.2).all()
    shut = search(face(1.2))
    assert not shut.to_goal and shut.poses[:, 0].max() < 1.2 - body_corners(ROBOT)[1, 0]


def test_a_robot_that_does_not_know_its_ground_is_not_joined_to_what_lies_behind_a_wall():
    ahead = worlds.flat_ground((0.45, 4.0))
    assert search_torso_path(START, 0.0, ahead, (2.0, 0.0), ROBOT, CONFIG).to_goal
    assert not search_torso_path(START, 0.0, ahead, (2.0, 0.0), ROBOT, CONFIG, heights=face(0.55)).success


def test_a_stance_has_room_for_the_torso_and_the_thighs_beside_it():
    room, level = TorsoRoom(ROBOT, face(1.0), clearance=0.05), np.zeros(3)
    nose, side = body_corners(ROBOT)[1, :2] + 0.05
    height = ROBOT.nominal_base_height
    for turn, reach in ((0.0, nose), (np.pi / 2, side)):
        rpy = np.array([0.0, 0.0, turn])
        assert room(np.array([1.0 - reach - 0.02, 0.0, height]), rpy)
        assert not room(np.array([1.0 - reach + 0.02, 0.0, height]), rpy)
    assert room(np.array([1.0, 0.0, height + 0.6]), level), "above it"
    ramp = TorsoRoom(ROBOT, heights(lambda x, y: np.tan(SLOPE) * x), clearance=0.05)
    assert not ramp(np.array([0.0, 0.0, 0.35]), level) and ramp(np.array([0.0, 0.0, 0.35]), np.array([0.0, -SLOPE, 0.0]))


def test_what_was_not_seen_beside_a_wall_is_taken_to_be_wall():
    """A camera that looks ahead sees of a wall beside the robot the part further on alone."""

    def wall_along_x(x, y):
        seen_from = 0.4
        known = np.where((abs(y + 0.6) < 0.7 * CELL) & (x > seen_from), 0.6, 0.0)
        return np.where((y < -0.6 - 0.7 * CELL) | ((y < -0.5) & (x < seen_from)), np.nan, known)

    known = heights(wall_along_x)
    along, towards = (0.2, 0.0, 0.0), (0.0, -0.35, -0.5)
    assert np.isfinite(penalty(known, along)).all()
    assert penalty(known, towards) == [np.inf]
    room = TorsoRoom(ROBOT, known, clearance=CONFIG.belly_clearance)
    answers = [room(np.array([x, y, START[2]]), np.array([0.0, 0.0, yaw])) for x, y, yaw in (along, towards)]
    assert answers == [True, False]
    unseen = heights(lambda x, y: np.where(y < -0.5, np.nan, 0.0))
    assert np.isfinite(penalty(unseen, towards)).all(), "nothing high near what was not seen"
