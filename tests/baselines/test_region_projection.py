"""The projection of footholds onto regions, against the geometry of shapely and inverse kinematics."""

import numpy as np
import pytest
import shapely.ops

from quadpips_drake.baselines.region_projection import (
    bases_over_regions,
    best_foothold,
    kinematic_penalty,
    leg_penalty,
)
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.planning.region_table import make_region_table
from quadpips_drake.robots.robot_library import load_robot
from tests.baselines.hand_made import random_region, region

NOWHERE = np.empty((0, 3)), np.empty((0, 3, 3))


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def nearest_by_shapely(planar, point):
    """Nearest point of the inset to ``point`` in W, by shapely."""
    R, origin = planar.X_WR[:3, :3], planar.X_WR[:3, 3]
    local = R.T @ (point - origin)
    inset, wanted = shapely.Polygon(planar.inset), shapely.Point(local[:2])
    near = shapely.ops.nearest_points(inset, wanted)[0]
    return origin + R[:, :2] @ [near.x, near.y]


def penalty_by_hand(robot, leg, foot, poses, max_extension):
    """instep^2 + over-extension^2 by the robot's own kinematics."""
    total, joints = 0.0, slice(3 * leg, 3 * leg + 3)
    haa, thigh, knee = robot.tree.joint_offset[joints]
    straight = np.hypot(knee[0], knee[2]) + np.hypot(robot.tree.foot_offset[leg][0], robot.tree.foot_offset[leg][2])
    lateral = thigh[1] + knee[1] + robot.tree.foot_offset[leg][1]
    for origin, rotation in zip(*poses, strict=True):
        p = rotation.T @ (foot - origin) - haa
        instep = max(0.0, -np.sign(robot.nominal_footholds_B[leg, 1]) * p[1])
        below = np.sqrt(max(0.0, p[1] ** 2 + p[2] ** 2 - lateral**2)) + thigh[2]
        stretch = max(0.0, np.hypot(p[0] - thigh[0], below) - max_extension * straight)
        total += instep**2 + stretch**2
    return total


@pytest.mark.parametrize("with_penalty", [False, True])
def test_the_best_of_random_regions(robot, with_penalty):
    """1,000 cases: 250 sets of regions, four points each; the best in sum, not only each by itself."""
    rng, legs, radius = np.random.default_rng(5), leg_penalty(robot, 0.8, 5.0), robot.foot_radius
    bitten = 0
    for _ in range(250):
        regions = [random_region(rng, k) for k in range(rng.integers(1, 9))]
        table = make_region_table(regions)
        for leg in range(4):
            point = rng.uniform(-0.7, 0.7, 3)
            base = point - np.append(robot.nominal_footholds_B[leg, :2], -0.5) + rng.uniform(-0.2, 0.2, (2, 3))
            rotations = np.array([rotation_from_rpy(rng.uniform(-0.3, 0.3, 3)) for _ in range(2)])
            poses = (base, rotations) if with_penalty else NOWHERE
            costs = []
            for planar in regions:
                near = nearest_by_shapely(planar, point)
                distance = np.linalg.norm(near - point)
                penalty = penalty_by_hand(robot, leg, near + radius * planar.normal, poses, 0.8)
                costs.append(distance**2 + 5.0 * penalty if distance <= 0.5 else np.inf)
                bitten += penalty > 1e-3
            k, *found = best_foothold(table, leg, point, *poses, legs, 0.5)
            if not np.isfinite(costs).any():
                assert k == -1
                continue
            assert costs[k] == pytest.approx(min(costs), abs=1e-9)
            np.testing.assert_allclose(found, nearest_by_shapely(regions[k], point), atol=1e-7)
    assert bitten > 500 or not with_penalty


def test_a_stretched_leg_takes_the_nearer_stone(robot):
    """The farther stone is as near to where the foot wants to go, but out of comfortable reach."""
    legs = leg_penalty(robot, 0.9, 5.0)
    hip = robot.nominal_footholds_B[0] * [1.0, 1.0, 0.0]
    stones = [region(k, hip + np.array([0.42 + dx, 0.0, 0.0]), (0.1, 0.1)) for k, dx in enumerate((0.11, -0.1105))]
    table, point = make_region_table(stones), hip + np.array([0.42, 0.0, 0.0])
    base = np.array([[0.0, 0.0, robot.nominal_base_height]]), np.eye(3)[None]
    assert best_foothold(table, 0, point, *NOWHERE, legs, 0.5)[0] == 0
    assert best_foothold(table, 0, point, *base, legs, 0.5)[0] == 1


def test_the_nominal_stance_costs_nothing_and_crossed_legs_do(robot):
    legs = leg_penalty(robot, 0.9, 5.0)
    base = np.zeros((1, 3)), np.eye(3)[None]
    for leg, foot in enumerate(robot.nominal_footholds_B):
        assert kinematic_penalty(leg, *foot, *base, legs) == 0.0
        inward = foot[1] - robot.hip_positions_B[leg, 1] + np.sign(foot[1]) * 0.05
        assert kinematic_penalty(leg, foot[0], foot[1] - inward, foot[2], *base, legs) == pytest.approx(0.05**2)


def test_no_region_near_enough(robot):
    legs, table = leg_penalty(robot, 0.9, 5.0), make_region_table([region(0, (1.0, 0.0, 0.0), (0.2, 0.2))])
    assert best_foothold(table, 0, np.zeros(3), *NOWHERE, legs, 0.8)[0] == -1
    assert best_foothold(table, 0, np.zeros(3), *NOWHERE, legs, 1.0)[0] == 0
    assert best_foothold(make_region_table([]), 0, np.zeros(3), *NOWHERE, legs, 9.0)[0] == -1


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.2, 0.0), (0.0, -0.15), (0.1, 0.1)])
def test_the_base_keeps_its_height_and_inclination_over_a_slope(robot, slope):
    table, legs = make_region_table([region(0, (0.0, 0.0, 1.0), (4.0, 4.0), slope)]), leg_penalty(robot, 0.9, 5.0)
    poses = np.array([[x, y, yaw] for x in (-0.3, 0.0, 0.4) for y in (0.0, 0.2) for yaw in (0.0, 0.5, 3.0)])
    plane = np.array([0.0, 0.0, 0.95, *slope])
    nominal = robot.nominal_footholds_B[:, :2].copy()
    found = bases_over_regions(table, poses, nominal, plane, legs, 0.5, 0.6, 0.5)
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
    # A point beside the plane is projected along its normal, a little downhill.
    np.testing.assert_allclose(found[:, 0], 1.0 + poses[:, :2] @ slope + 0.6, atol=0.005)
    for (_, _, yaw), (_, roll, pitch) in zip(poses, found, strict=True):
        np.testing.assert_allclose(rotation_from_rpy(np.array([roll, pitch, yaw]))[:, 2], normal, atol=0.01)


def test_over_nothing_the_base_follows_the_plane_of_the_feet(robot):
    legs, nominal = leg_penalty(robot, 0.9, 5.0), robot.nominal_footholds_B[:, :2].copy()
    plane = np.array([0.0, 0.0, 0.3, 0.1, 0.0])
    found = bases_over_regions(make_region_table([]), np.zeros((1, 3)), nominal, plane, legs, 0.5, 0.6, 0.5)
    np.testing.assert_allclose(found[0], [0.9 + 0.1 * nominal[:, 0].mean(), 0.0, -np.arctan(0.1)], atol=1e-9)
