"""Room below thighs and knees, on hand-made maps."""

import numpy as np
import pytest

from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.planning.nominal_pose import base_pose_above
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trajectory.swing.thigh_clearance import room_below_thighs
from quadpips_drake.values.centroidal import centroidal_state
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.regions import GroundHeights

ROBOTS = {name: load_robot(name) for name in ("anymal_c", "go2")}
GO2 = ROBOTS["go2"]
CELL, CORNER = 0.01, -1.5


def heights(surface) -> GroundHeights:
    """A map of 3 x 3 m about the origin; ``surface``: heights at x, y (n, n) each."""
    middles = CORNER + CELL * (np.arange(300) + 0.5)
    x, y = np.meshgrid(middles, middles, indexing="ij")
    return GroundHeights(0.0, np.full(2, CORNER), CELL, surface(x, y).astype(np.float32))


def edge(at: float, drop: float) -> GroundHeights:
    """Level ground at 0 up to x = ``at``, ``drop`` lower beyond."""
    return heights(lambda x, y: np.where(x < at, 0.0, -drop))


def standing(robot=GO2, lean=(0.0, 0.0, 0.0), **moved) -> np.ndarray:
    """The state of a stance above the origin, some ground points (by leg) moved by (3,) [m], the base moved by ``lean``."""
    feet = robot.soles_W(robot.nominal_footholds_B)
    feet[:, 2] = 0.0
    for leg, by in moved.items():
        feet[Leg[leg]] += by
    p_WB, rpy_WB = base_pose_above(feet, robot.nominal_base_height, 0.35)
    p_WB, R_WB = p_WB + lean, rotation_from_rpy(rpy_WB)
    joints = []
    for leg in Leg:
        p_BF = R_WB.T @ (feet[leg] + [0.0, 0.0, robot.foot_radius] - p_WB)
        angles, reached = robot.leg_inverse_kinematics_B(int(leg), p_BF)
        assert reached
        joints.append(angles)
    return centroidal_state(p_WB, rpy_WB, np.concatenate(joints))


def below_axes(robot, x, known) -> np.ndarray:
    """The room straight below the axes of all thighs, (4,)."""
    rotations, origins = robot.link_poses_B(x[12:])
    R_WB, shapes, free = rotation_from_rpy(x[9:12]), robot.leg_shapes, np.full(4, np.inf)
    for leg in range(4):
        for k in np.flatnonzero((shapes.links[leg] == 0) & (shapes.radii[leg] > 0.0)):
            along = np.linspace(*shapes.ends[leg, k], 60) @ rotations[3 * leg + 2].T + origins[3 * leg + 2]
            points = x[6:9] + along @ R_WB.T
            free[leg] = min(free[leg], (points[:, 2] - shapes.radii[leg, k] - known.at(*points[:, :2].T)).min())
    return free


@pytest.mark.parametrize("name", ROBOTS)
def test_the_room_is_that_of_the_shapes(name):
    robot, rng = ROBOTS[name], np.random.default_rng(0)
    known = heights(lambda x, y: 0.04 * np.sin(3.0 * x) + 0.03 * np.cos(4.0 * y))
    for _ in range(20):
        x = standing(robot, **{leg.name: rng.uniform(-0.04, 0.04, 3) for leg in Leg})
        beyond = room_below_thighs(robot, x[None], known) - below_axes(robot, x, known)
        assert (beyond > -0.01).all() and (beyond < 0.02).all(), "points are 2 cm apart, and the lowest one does not count"


def test_a_torso_that_stays_behind_an_edge_sets_a_knee_on_it():
    down = {"RF": (0.1, 0.0, -0.17)}
    above, behind = standing(**down), standing(lean=(-0.05, 0.0, -0.03), **down)
    known = edge(0.23, 0.17)
    room = [room_below_thighs(GO2, x[None], known)[Leg.RF] for x in (above, behind)]
    assert room[1] < 0.0
    assert room[1] < room[0] - 0.01
    motion = np.vstack([np.tile(behind, (4, 1)), np.tile(above, (8, 1))])
    assert room_below_thighs(GO2, motion, known)[Leg.RF] == pytest.approx(room[1]), "the worst of a motion counts"


def test_nothing_is_in_the_way_where_nothing_is_known():
    for nothing in (None, GroundHeights.empty()):
        assert np.isinf(room_below_thighs(GO2, standing()[None], nothing)).all()


@pytest.mark.parametrize("cells", [1, 5])
def test_one_cell_alone_may_be_noise(cells):
    x, ground = standing(), np.zeros((300, 300), np.float32)
    _, origins = GO2.link_poses_B(x[12:])
    shank = origins[3 * Leg.RF + 3] + x[6:9]
    row, column = np.floor((shank[:2] - CORNER) / CELL).astype(int)
    half = cells // 2
    ground[row - half : row + half + 1, column - half : column + half + 1] = shank[2]
    known = GroundHeights(0.0, np.full(2, CORNER), CELL, ground)
    assert (room_below_thighs(GO2, x[None], known)[Leg.RF] < 0.0) == (cells > 1)
