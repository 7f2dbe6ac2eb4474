"""The numba kernels of the searches, held against plain computations."""

import numpy as np
import pytest

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.stance_rules import make_transition_model, support_distance
from quadpips_drake.planning.footholds.stance_transitions import cost_rate, distance_to_go, pose_of_stance_legs
from quadpips_drake.planning.nominal_pose import base_pose_above, to_frame
from quadpips_drake.planning.region_table import foothold_near, make_region_table
from quadpips_drake.robots.reachability import in_leg_workspace, inside_superquadric, leg_chains
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.legs import Leg
from tests.planning import worlds


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_leg_workspace_agrees_with_inverse_kinematics(name):
    robot = load_robot(name)
    chains, nominal = leg_chains(robot), robot.nominal_footholds_B
    rng = np.random.default_rng(0)
    reached = 0
    for _ in range(600):
        leg = Leg(int(rng.integers(4)))
        p_BF = nominal[leg] + rng.uniform(-0.25, 0.25, 3)
        q, ok = robot.leg_inverse_kinematics_B(leg, p_BF)
        knee_branch = q[2] * robot.nominal_joints[leg.joints][2] > 0.0
        # Away from the nominal pose the inverse kinematics may return another solution for HFE, never a reachable "no".
        answer = in_leg_workspace(int(leg), *p_BF, chains, 1.0)
        assert answer <= ok
        reached += answer
        if ok and knee_branch and np.abs(q - robot.nominal_joints[leg.joints]).max() < 1.2:
            assert answer
    assert reached > 100
    x, y, z = nominal[Leg.LF]
    assert in_leg_workspace(0, x, y, z, chains, 0.98) and not in_leg_workspace(0, x, y, z, chains, 0.70)


def test_superquadric_is_equation_15():
    center, axes, exponents = np.array([0.1, 0.2, -0.5]), np.array([0.4, 0.2, 0.3]), np.array([2.0, 4.0, 5.0])
    rng = np.random.default_rng(1)
    for p in center + rng.uniform(-0.5, 0.5, (200, 3)):
        expected = np.sum(np.abs((p - center) / axes) ** exponents) <= 1.0
        assert inside_superquadric(*p, center, axes, exponents) == expected


def test_base_pose_follows_the_plane_of_the_feet():
    robot = load_robot("anymal_c")
    flat = robot.nominal_footholds_B * [1.0, 1.0, 0.0]
    for roll, pitch, yaw in ((0.0, 0.0, 0.0), (0.1, -0.2, 2.0), (-0.15, 0.1, -3.0)):
        R = rotation_from_rpy(np.array([roll, pitch, yaw]))
        feet = flat @ R.T + [1.0, 2.0, 3.0]
        p_WB, rpy = base_pose_above(feet, 0.58, 0.35)
        np.testing.assert_allclose(rotation_from_rpy(rpy)[:, 2], R[:, 2], atol=1e-9)
        assert wrap_angle(rpy[2] - np.arctan2(R[1, 0], R[0, 0])) == pytest.approx(0.0, abs=1e-9)
        np.testing.assert_allclose(p_WB, feet.mean(axis=0) + np.array([0.0, 0.0, 0.58]), atol=1e-9)
    steep = flat @ rotation_from_rpy(np.array([0.0, -0.6, 0.0])).T
    assert base_pose_above(steep, 0.58, 0.35)[1][1] == pytest.approx(-0.35)
    twisted = flat + np.outer([0.05, -0.05, -0.05, 0.05], [0.0, 0.0, 1.0])
    assert base_pose_above(twisted, 0.58, 0.35)[0][2] < 0.58 - 0.04  # the lowest foot still has its leg's reach


def test_to_frame_inverts_a_pose():
    R, p = rotation_from_rpy(np.array([0.1, 0.2, 0.3])), np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(to_frame(R, p, *(R @ [0.3, -0.2, 0.1] + p)), [0.3, -0.2, 0.1], atol=1e-12)


def test_foothold_near_lies_on_the_region_and_is_nearest():
    regions = [worlds.patch(0, 0.0, 0.0, 0.3, 0.2, z=0.1, margin=0.04), worlds.patch(1, 1.0, 0.5, 0.3, 0.2, slope=0.2)]
    table = make_region_table(regions)
    np.testing.assert_allclose(foothold_near(table, 0, 0.05, -0.02, 0.03), [0.05, -0.02, 0.1], atol=1e-12)
    np.testing.assert_allclose(foothold_near(table, 0, 0.5, 0.0, 0.0), [0.11, 0.0, 0.1], atol=1e-12)
    assert foothold_near(table, 0, 0.5, 0.0, 0.03)[0] == pytest.approx(0.08)
    point = np.array(foothold_near(table, 1, 1.05, 0.5, 0.03))
    assert point[0] == pytest.approx(1.05)
    assert (point - regions[1].center) @ regions[1].normal == pytest.approx(0.0, abs=1e-12)


def test_pose_of_stance_legs_recovers_a_rigid_motion():
    robot = load_robot("anymal_c")
    nominal = np.ascontiguousarray(robot.nominal_footholds_B[:, :2])
    R = rotation_from_rpy(np.array([0.0, 0.0, 0.4]))
    feet = robot.nominal_footholds_B @ R.T + [0.7, -0.2, 0.0]
    for legs in ((1, 2), (0, 3), (2,)):
        swinging = np.isin(np.arange(4), legs)
        np.testing.assert_allclose(pose_of_stance_legs(feet, swinging, 0.0, nominal), (0.7, -0.2, 0.4), atol=1e-12)


def test_cost_to_go_is_consistent():
    rng = np.random.default_rng(2)
    path = np.ascontiguousarray(np.cumsum(rng.uniform(-0.1, 0.3, (8, 3)), axis=0))
    steps = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1) + 0.4 * np.abs(np.diff(path[:, 2]))
    remaining = np.append(np.cumsum(steps[::-1])[::-1], 0.0)
    assert distance_to_go(*path[-1], path, remaining, 0.4)[0] == 0.0
    for a, b in rng.uniform(-1.0, 2.0, (200, 2, 3)):
        moved = np.hypot(*(a - b)[:2]) + 0.4 * abs(wrap_angle(a[2] - b[2]))
        difference = distance_to_go(*a, path, remaining, 0.4)[0] - distance_to_go(*b, path, remaining, 0.4)[0]
        assert abs(difference) <= moved + 1e-9


def test_no_swing_is_cheaper_than_the_rate():
    config = FootholdConfig()
    for swing in np.linspace(0.01, config.max_swing, 20):
        cost = 0.5 * config.step_weight * (1.0 + (swing / config.preferred_swing) ** 2) + swing / 4.0
        assert cost >= cost_rate(config) * swing / 4.0 - 1e-12


def test_transition_model_has_one_type_for_all_settings():
    robot = load_robot("go2")
    first = make_transition_model(robot, FootholdConfig())
    second = make_transition_model(robot, FootholdConfig(max_swing=1, candidate="center"))
    assert [type(value) for value in first] == [type(value) for value in second]


FEET = np.array([[0.4, 0.2, 0.0], [0.4, -0.2, 0.0], [-0.4, 0.2, 0.0], [-0.4, -0.2, 0.0]])


@pytest.mark.parametrize(
    ("swinging", "point", "expected"),
    [
        ((1, 2), (0.0, 0.0), 0.0),  # on the diagonal LF-RH
        ((1, 2), (-0.2, 0.4), 0.2 * np.sqrt(5.0)),  # square to it
        ((1, 2), (0.6, 0.2), 0.2),  # beyond its end
        ((2,), (0.0, -0.1), 0.0),  # inside the triangle of the other three
        ((2,), (0.0, 0.2), 0.4 / np.sqrt(5.0)),  # outside, beside the diagonal
        ((0,), (0.1, 0.0), 0.1 / np.sqrt(5.0)),
    ],
)
def test_support_distance(swinging, point, expected):
    flags = np.isin(np.arange(4), swinging)
    assert support_distance(FEET, flags, *point) == pytest.approx(expected, abs=1e-12)
