"""Shapes of the legs against Drake's proximity engine, and the stance limits that follow from them."""

import numpy as np
import pytest

from quadpips_drake.robots.leg_shapes import are_nearer, leg_gap, place_capsules
from quadpips_drake.robots.reachability import leg_chains
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.stance_limits import stance_limits
from quadpips_drake.values.legs import Leg

ROBOTS = ("anymal_c", "go2")


@pytest.mark.parametrize("name", ROBOTS)
def test_capsules_are_where_the_links_are(name):
    robot, rng = load_robot(name), np.random.default_rng(0)
    chains, shapes = leg_chains(robot), robot.leg_shapes
    for _ in range(20):
        feet = robot.nominal_footholds_B + rng.uniform(-0.08, 0.08, (4, 3)) * [1, 1, 0.3]
        q = np.array(robot.nominal_joints)
        for leg in Leg:
            q[leg.joints], reached = robot.leg_inverse_kinematics_B(int(leg), feet[leg])
            assert reached
        rotations, origins = robot.link_poses_B(q)
        for leg in Leg:
            placed = np.empty((shapes.radii.shape[1], 2, 3))
            place_capsules(int(leg), *feet[leg], chains, shapes, placed)
            for k, link in enumerate(shapes.links[leg]):
                body = 1 + 3 * leg + 1 + link
                np.testing.assert_allclose(placed[k], shapes.ends[leg, k] @ rotations[body].T + origins[body], atol=1e-9)


def test_gap_between_two_feet_side_by_side():
    robot = load_robot("anymal_c")
    feet = robot.nominal_footholds_B.copy()
    feet[[0, 1], 1] = [0.05, -0.05]
    gap = leg_gap(0, feet[0], 1, feet[1], leg_chains(robot), robot.leg_shapes)
    assert gap <= 0.10 - 2 * robot.foot_radius + 1e-9
    feet[[0, 1], 1] = [0.02, -0.02]
    assert leg_gap(0, feet[0], 1, feet[1], leg_chains(robot), robot.leg_shapes) < 0.0


@pytest.mark.parametrize("name", ROBOTS)
def test_legs_are_nearer_than_a_distance_if_their_gap_is(name):
    robot, rng = load_robot(name), np.random.default_rng(2)
    chains, shapes = leg_chains(robot), robot.leg_shapes
    placed, answers = np.empty((4, shapes.radii.shape[1], 2, 3)), []
    for _ in range(200):
        i, j = ((0, 1), (2, 3), (0, 2), (1, 3))[rng.integers(4)]
        feet = robot.nominal_footholds_B.copy()
        feet[[i, j]] = feet[[i, j]].mean(axis=0) + rng.uniform(-0.12, 0.12, (2, 3)) * [1, 1, 0.3]
        for leg in (i, j):
            place_capsules(leg, *feet[leg], chains, shapes, placed[leg])
        gap = leg_gap(i, feet[i], j, feet[j], chains, shapes)
        for distance in (0.02, 0.1, gap, np.nextafter(gap, 1.0)):
            answers.append(are_nearer(i, placed[i], j, placed[j], shapes, distance))
            assert answers[-1] == (gap < distance)
    assert 200 < sum(answers) < 600


@pytest.mark.parametrize("name", ROBOTS)
def test_limits_are_the_robots_own(name):
    robot = load_robot(name)
    limits, feet = stance_limits(robot), robot.nominal_footholds_B
    assert limits.min_width < feet[0, 1] - feet[1, 1] < limits.max_width
    assert limits.min_length < feet[0, 0] - feet[2, 0] < limits.max_length
    assert limits.min_width >= 2 * robot.foot_radius + robot.leg_clearance - 0.01
    shorter = stance_limits(robot, 0.90)
    assert shorter.max_width < limits.max_width or shorter.max_length < limits.max_length
