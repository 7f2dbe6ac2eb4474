"""Random scenes and camera paths."""

import numpy as np
import pytest

from quadpips_drake.learning.camera_path import CameraPathConfig, camera_poses, heights_below
from quadpips_drake.learning.primitives import LabelPolicy
from quadpips_drake.learning.scenes import SCENE_KINDS, make_scene_of_kind
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.steppability import Steppability


@pytest.mark.parametrize("kind", SCENE_KINDS)
def test_every_kind_of_scene_has_ground_and_depends_on_the_seed_alone(kind):
    for seed in range(3):
        first = make_scene_of_kind(kind, np.random.default_rng(seed), LabelPolicy())
        again = make_scene_of_kind(kind, np.random.default_rng(seed), LabelPolicy())
        for label in Steppability:
            triangles = first.triangles(label)
            assert np.isfinite(triangles).all()
            np.testing.assert_array_equal(triangles, again.triangles(label))
        assert len(first.triangles(Steppability.UNKNOWN)) == 0
        assert len(first.triangles(Steppability.STEPPABLE)) > 0
        assert first.start == again.start


def test_steps_of_low_stairs_are_passable():
    for seed in range(20):
        scene = make_scene_of_kind("stairs", np.random.default_rng(seed), LabelPolicy(1.0))
        assert len(scene.triangles(Steppability.PASSABLE)) > 0


def test_sides_of_stones_over_a_pit_are_not_passable():
    for seed in range(10):
        scene = make_scene_of_kind("stones", np.random.default_rng(seed), LabelPolicy())
        assert len(scene.triangles(Steppability.PASSABLE)) == 0
        assert len(scene.triangles(Steppability.NON_PASSABLE)) > 0


def test_height_below_is_that_of_the_highest_triangle():
    low = np.array([[[-1, -1, 0.0], [1, -1, 0.0], [0, 1, 0.0]]])
    heights = heights_below(np.concatenate([low, low + np.array([0, 0, 0.3])]), np.array([[0.0, 0.0], [5.0, 0.0]]))
    assert heights[0] == pytest.approx(0.3)
    assert np.isnan(heights[1])


def test_the_camera_keeps_its_height_over_level_ground():
    robot = load_robot("anymal_c")
    ground = np.array([[[-9, -9, 0.2], [9, -9, 0.2], [0, 30, 0.2]]])
    still = CameraPathConfig(jitter_position=0, jitter_angle=0)
    X_BC = robot.camera().X_BC
    poses = camera_poses(robot, X_BC, (0, 0, 0.4), ground, 4, np.random.default_rng(0), still)
    assert len(poses) == 4
    for X_WC in poses:
        assert X_WC[2, 3] == pytest.approx(0.2 + robot.nominal_base_height + X_BC[2, 3])
        assert -X_WC[2, 2] == pytest.approx(0.5, abs=1e-3)  # the optical axis, 30 degrees below the horizon
    ways = np.linalg.norm(np.diff([X_WC[:2, 3] for X_WC in poses], axis=0), axis=1)
    assert (ways > 0.03).all() and (ways < 0.6).all()


def test_the_camera_survives_a_world_without_ground():
    robot = load_robot("go2")
    poses = camera_poses(
        robot, robot.camera().X_BC, (0, 0, 0), np.zeros((0, 3, 3)), 2, np.random.default_rng(0), CameraPathConfig()
    )
    assert np.isfinite(poses).all()
