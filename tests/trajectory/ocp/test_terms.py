"""Each term of the optimal control problem: its derivatives, and that it means what it says."""

import numpy as np
import pytest

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.sensing.robot_shapes import trunk_corners
from quadpips_drake.trajectory.centroidal.centroidal_derivatives import knot_derivatives
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.ocp.projection import orthogonal_basis, project_inputs
from quadpips_drake.trajectory.ocp.terms.foothold_region import add_foothold_region
from quadpips_drake.trajectory.ocp.terms.friction_cone import FRICTION, ROWS, friction_pyramid, surface_frame
from quadpips_drake.trajectory.ocp.terms.joint_limits import add_box_limits, add_torque_limits
from quadpips_drake.trajectory.ocp.terms.relaxed_barrier import relaxed_barrier
from quadpips_drake.trajectory.ocp.terms.sdf_clearance import add_sdf_clearance
from quadpips_drake.trajectory.ocp.terms.stance_foot import stance_foot
from quadpips_drake.trajectory.ocp.terms.swing_foot import swing_foot
from quadpips_drake.trajectory.ocp.terms.terminal_cost import regulator_cost, turned_to_yaw
from quadpips_drake.trajectory.ocp.terms.tracking_cost import add_foot_tracking, add_tracking
from quadpips_drake.values.centroidal import CentroidalInput as Input
from tests.trajectory.centroidal.test_centroidal_model import random_points
from tests.trajectory.walking import central_difference


@pytest.fixture(scope="module")
def model():
    return CentroidalModel(load_robot("anymal_c"))


def knot(model, z):
    """Derivatives at z = [x; u]: (p, v, p_x, v_x, v_u) and the geometry (rotation, its derivatives, kinematics)."""
    arrays = [np.empty(s) for s in ((24,), (24, 24), (24, 24), (4, 3), (4, 3), (4, 3, 24), (4, 3, 24), (4, 3, 24))]
    geometry = knot_derivatives(model.tree, z[:24].copy(), z[24:].copy(), *arrays)
    return arrays[3:], geometry


def quadratic(term, z):
    """Cost, gradient and Hessian that ``term(z, hessian, linear) -> cost`` adds."""
    hessian, linear = np.zeros((48, 48)), np.zeros(48)
    return term(z, hessian, linear), linear, hessian


def check_gradient(term, z, rtol=1e-5):
    _, linear, hessian = quadratic(term, z)
    expected = central_difference(lambda y: np.array(quadratic(term, y)[0]), z, 1e-6)
    np.testing.assert_allclose(linear, expected, rtol=rtol, atol=rtol * max(1.0, np.abs(expected).max()))
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-9)
    assert np.linalg.eigvalsh(hessian).min() > -1e-7 * max(1.0, np.abs(hessian).max())


@pytest.fixture(scope="module")
def z(model):
    return np.concatenate([points[0] for points in random_points(model, 1, seed=11)])


def test_barrier_is_twice_differentiable():
    for h in (-0.3, 0.05, 0.1, 0.4):
        _, first, second = relaxed_barrier(h, 0.2, 0.1)
        step = 1e-6
        above, below = relaxed_barrier(h + step, 0.2, 0.1), relaxed_barrier(h - step, 0.2, 0.1)
        assert first == pytest.approx((above[0] - below[0]) / (2 * step), rel=1e-5)
        assert second == pytest.approx((above[1] - below[1]) / (2 * step), rel=1e-4)


def test_tracking_cost(model, z):
    rng = np.random.default_rng(1)
    weights, reference = rng.uniform(0, 2, 48), rng.normal(size=48)

    def term(y, hessian, linear):
        return add_tracking(y[:24], y[24:], reference[:24], reference[24:], weights[:24], weights[24:], 0.1, hessian, linear)

    check_gradient(term, z)
    assert quadratic(term, z)[0] == pytest.approx(0.05 * weights @ (z - reference) ** 2)


def clearance_term(model, ground, corners, radii=(0.08, 0.05), barrier=(2.5, 0.005, 0.3)):
    def term(y, hessian, linear):
        _, (rotation, by_angles, kinematics) = knot(model, y)
        placed = (rotation, by_angles, kinematics[0], kinematics[1])
        return add_sdf_clearance(y[:24].copy(), placed, ground, corners, radii, barrier, 0.1, hessian, linear)

    return term


def tilted_ground(scale=1.0):
    """A field that is linear in space, so that its gradient does not jump from voxel to voxel: 0.9 z + 0.4 x + 0.1 y."""
    x, y, z = np.meshgrid(*(np.linspace(-4.0, 4.0, 9),) * 3, indexing="ij")
    return (scale * (0.9 * z + 0.4 * x + 0.1 * y)).astype(np.float32), np.full(3, -4.0), 1.0


def test_clearance_of_knees_and_trunk(model, z):
    corners = trunk_corners(model.robot)
    assert corners.shape == (4, 3) and np.ptp(corners[:, 0]) > 0.5 and (corners[:, 2] < 0).all()
    z = z.copy()
    z[6:9] = 0.0, 0.0, 0.0
    costs = []
    for height in (0.0, 0.2, 0.35):  # in the ground, partly out of it, mostly out of reach
        z[8] = height
        term = clearance_term(model, tilted_ground(), corners)
        check_gradient(term, z, rtol=1e-4)
        costs.append(quadratic(term, z)[0])
    assert costs[0] > costs[1] > costs[2] >= 0.0
    z[8] = 3.0
    cost, linear, hessian = quadratic(clearance_term(model, tilted_ground(), corners), z)
    assert cost == 0.0 and not linear.any() and not hessian.any(), "out of reach"
    z[6] = 50.0
    assert quadratic(clearance_term(model, tilted_ground(), corners), z)[0] == 0.0, "nothing is known there"


def test_the_clearance_ends_smoothly_at_its_reach(model, z):
    z, at = z.copy(), []
    z[3:6] = z[6:12] = 0.0
    flat = np.tile(np.linspace(-4.0, 4.0, 9, dtype=np.float32), (9, 9, 1)), np.full(3, -4.0), 1.0
    for height in (0.349999, 0.35, 0.350001):  # one corner 0.3 m above a sphere's radius of 0.05 m
        z[8] = height
        cost, linear, _ = quadratic(clearance_term(model, flat, np.zeros((1, 3)), radii=(-9.0, 0.05)), z)
        at.append((cost, linear[8]))
    np.testing.assert_allclose(at, 0.0, atol=1e-5)


def test_foot_tracking(model, z):
    def term(y, hessian, linear):
        (p, v, p_x, v_x, v_u), _ = knot(model, y)
        references, weights = (np.ones(3), np.zeros(3)), (np.array([1.0, 2.0, 3.0]), np.array([0.3, 0.2, 0.1]))
        return add_foot_tracking(1, p[1], v[1], *references, p_x[1], v_x[1], v_u[1], *weights, 0.1, hessian, linear)

    check_gradient(term, z)


def test_foothold_region(model, z):
    normals, offsets = np.array([[1.0, 0.2, 0.0], [0.0, 0.0, 0.0]]), np.array([0.1, 0.0])

    def term(y, hessian, linear):
        (p, _, p_x, _, _), _ = knot(model, y)
        return add_foothold_region(2, p[2], p_x[2], normals, offsets, 0.1, 0.01, 0.1, hessian, linear)

    check_gradient(term, z)
    p = knot(model, z)[0][0][2]
    assert quadratic(term, z)[0] == pytest.approx(0.1 * relaxed_barrier(normals[0] @ p + 0.1, 0.1, 0.01)[0])


def test_joint_limits(model, z):
    robot = model.robot

    def box(y, hessian, linear):
        limits = robot.position_limits_lower, robot.position_limits_upper
        return add_box_limits(y[12:24], *limits, 0.1, 0.01, 0.1, hessian[12:, 12:], linear[12:])

    def torque(y, hessian, linear):
        _, (rotation, angles, kinematics) = knot(model, y)
        axes, origins, feet = kinematics[0], kinematics[1], kinematics[4]
        return add_torque_limits(
            y[24:].copy(), rotation, angles, axes, origins, feet, robot.effort_limits, 1.0, 1.0, 0.1, hessian, linear
        )

    check_gradient(box, z)
    check_gradient(torque, z)


def test_foot_constraints_are_derivatives_of_their_residuals(model, z):
    p_ref, v_ref, normal = np.array([0.1, 0.2, 0.3]), np.array([0.3, -0.1, 0.2]), np.array([0.6, 0.0, 0.8])

    def rows(y):
        (p, v, p_x, v_x, v_u), _ = knot(model, y)
        by_state, by_rates, residual = np.zeros((12, 24)), np.zeros((12, 12)), np.zeros(12)
        row = stance_foot(p[0], v[0], p_ref, p_x[0], v_x[0], v_u[0], 5.0, 0, by_state, by_rates, residual)
        row = swing_foot(p[3], v[3], p_ref, v_ref, normal, p_x[3], v_x[3], v_u[3], 15.0, row, by_state, by_rates, residual)
        assert row == 4
        return residual[:4], by_state[:4], by_rates[:4], (p, v)

    residual, by_state, by_rates, (p, v) = rows(z)
    np.testing.assert_allclose(residual[:3], v[0] + 5.0 * (p[0] - p_ref))
    assert residual[3] == pytest.approx(normal @ (v[3] - v_ref + 15.0 * (p[3] - p_ref)))
    expected = central_difference(lambda y: rows(y)[0], z)
    np.testing.assert_allclose(np.hstack((by_state, np.zeros((4, 12)), by_rates)), expected, atol=1e-5)


def test_friction_pyramid_in_the_surface_frame():
    normal = np.array([-np.sin(0.4), 0.0, np.cos(0.4)])
    rows = np.empty((ROWS, 3))
    friction_pyramid(tuple(normal), 0.7, 0.6, rows)
    frame = np.array(surface_frame(normal, 0.7))
    assert frame[0] @ [-np.sin(0.7), np.cos(0.7), 0.0] == pytest.approx(0.0, abs=0.1)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(frame[2], normal)
    for degrees in range(0, 360, 5):
        tangent = np.cos(np.radians(degrees)) * frame[0] + np.sin(np.radians(degrees)) * frame[1]
        granted = 5.99 if degrees % 60 == 0 else 5.19  # all of the cone along the heading, 87 % of it anywhere
        assert (rows @ (10 * normal + granted * tangent) > 0).all()
        assert (rows @ (10 * normal + 6.01 * tangent)).min() < 0
    assert (rows @ -normal < 0).all()


@pytest.mark.parametrize("heading", [0.0, 0.4, 2.0])
def test_standing_upright_on_the_steepest_worlds_is_within_the_friction_polyhedron(heading):
    rows = np.empty((ROWS, 3))
    for degrees in (24.8, 28.2):
        slope = np.radians(degrees)
        friction_pyramid((-np.sin(slope), 0.0, np.cos(slope)), heading, FRICTION, rows)
        assert (rows @ [0.0, 0.0, 1.0] > 0.05).all()


def test_projection_satisfies_all_constraints():
    rng = np.random.default_rng(3)
    stance = np.array([True, False, False, True])
    num_rows = 8
    by_state, by_rates, residual = rng.normal(size=(12, 24)), rng.normal(size=(12, 12)), rng.normal(size=12)
    change, force_scale, rate_map, free = np.zeros(24), np.empty(12), np.empty((12, 36)), np.empty(12, dtype=bool)
    change[3:9] = -7.0
    overwritten = by_state.copy(), by_rates.copy(), residual.copy()
    project_inputs(stance, num_rows, *overwritten, 100.0, change, force_scale, rate_map, free)
    np.testing.assert_array_equal(force_scale, np.repeat([100.0, 0.0, 0.0, 100.0], 3))
    np.testing.assert_array_equal(change[3:9], -7.0)
    for _ in range(3):
        step = rng.normal(size=36)
        rates = change[Input.JOINT_VELOCITIES] + rate_map @ step
        rows = by_state[:num_rows] @ step[:24] + by_rates[:num_rows] @ rates + residual[:num_rows]
        np.testing.assert_allclose(rows, 0, atol=1e-10)
    assert free.sum() == 10  # six forces and four directions of the joint rates
    factors = orthogonal_basis(by_rates, num_rows)
    triangle, basis = np.triu(factors[:num_rows, :num_rows]), factors[:, num_rows:].T
    np.testing.assert_allclose(basis @ basis.T, np.eye(12), atol=1e-12)
    np.testing.assert_allclose(basis[:, :num_rows] @ triangle, by_rates[:num_rows].T, atol=1e-12)


def test_regulator_cost_is_the_cost_to_go():
    rng = np.random.default_rng(4)
    dynamics_x, dynamics_u = rng.normal(size=(3, 3)) * 0.6, rng.normal(size=(3, 2))
    dynamics_x[2], dynamics_u[2] = [0.0, 0.0, 1.0], 0.0  # out of control, and it does not fade
    hessian = np.eye(5)
    cost = regulator_cost(dynamics_x, dynamics_u, hessian, 200)
    assert np.isfinite(cost).all()
    assert np.linalg.eigvalsh(cost).min() > 0
    nearly = regulator_cost(dynamics_x, dynamics_u, hessian, 201)
    np.testing.assert_allclose(nearly[:2, :2], cost[:2, :2], rtol=1e-6)
    assert nearly[2, 2] > cost[2, 2] + 0.9


def test_terminal_cost_turns_with_the_robot():
    rng = np.random.default_rng(5)
    root = rng.normal(size=(24, 24))
    cost, error = root @ root.T, rng.normal(size=24)
    turned = error.copy()
    for first in (0, 3, 6):
        turned[first], turned[first + 1] = -error[first + 1], error[first]
    assert turned @ turned_to_yaw(cost, np.pi / 2) @ turned == pytest.approx(error @ cost @ error)
