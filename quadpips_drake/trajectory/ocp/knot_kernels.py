"""Linear-quadratic approximation of all knots of the optimal control problem, in one numba call."""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.math.small_algebra import vector
from quadpips_drake.robots.kinematic_tree import KinematicTree
from quadpips_drake.trajectory.centroidal.centroidal_derivatives import dynamics_derivatives, knot_derivatives
from quadpips_drake.trajectory.centroidal.centroidal_kernels import ANGULAR, JOINT_RATES, JOINTS
from quadpips_drake.trajectory.ocp.projection import project_inputs
from quadpips_drake.trajectory.ocp.reduction import PACKED, STAGE, reduce_cost, reduce_dynamics
from quadpips_drake.trajectory.ocp.terms.foothold_region import add_foothold_region
from quadpips_drake.trajectory.ocp.terms.friction_cone import INACTIVE_BOUND, INNER, ROWS, friction_pyramid
from quadpips_drake.trajectory.ocp.terms.joint_limits import add_box_limits, add_torque_limits
from quadpips_drake.trajectory.ocp.terms.sdf_clearance import add_sdf_clearance
from quadpips_drake.trajectory.ocp.terms.stance_foot import stance_foot
from quadpips_drake.trajectory.ocp.terms.swing_foot import swing_foot
from quadpips_drake.trajectory.ocp.terms.tracking_cost import add_angular_momentum_tracking, add_foot_tracking, add_tracking
from quadpips_drake.trajectory.ocp.terms.zero_force import zero_force
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE, CentroidalState
from quadpips_drake.values.legs import NUM_JOINTS

STATES, INPUTS = STATE_SIZE, INPUT_SIZE
YAW = CentroidalState.YAW
_MAX_GAIN_TIMES_STEP = 0.8


class OcpParameters(NamedTuple):
    """What does not change from solve to solve, as numba wants it; barriers are (mu, delta)."""

    tree: KinematicTree
    state_weights: np.ndarray
    input_weights: np.ndarray
    angular_momentum_weights: np.ndarray
    foot_position_weights: np.ndarray
    foot_velocity_weights: np.ndarray
    position_barrier: tuple
    velocity_barrier: tuple
    torque_barrier: tuple
    foothold_barrier: tuple
    position_lower: np.ndarray
    position_upper: np.ndarray
    velocity_lower: np.ndarray
    velocity_upper: np.ndarray
    torque_limits: np.ndarray
    stance_gain: float
    swing_gain: float
    swing_directions: int
    min_normal_force: float
    force_unit: float
    clearance_barrier: tuple
    """mu, delta, reach."""
    clearance_radii: tuple
    """At knees, at corners of the trunk."""
    trunk_corners: np.ndarray


class TaskArrays(NamedTuple):
    """The part of a TrackingTask that the kernels read, all arrays contiguous."""

    times: np.ndarray
    x_ref: np.ndarray
    u_ref: np.ndarray
    stance: np.ndarray
    foot_ref_p: np.ndarray
    foot_ref_v: np.ndarray
    surface_normal: np.ndarray
    halfspace_normals: np.ndarray
    halfspace_offsets: np.ndarray
    friction: float
    distance: np.ndarray
    """Of a SignedDistance; without entries: the ground is not known."""
    distance_origin: np.ndarray
    distance_step: float


class KnotBlocks(NamedTuple):
    """Quadratic model of n knots in z = [dx; w] and what leads back to du."""

    hessian: np.ndarray
    """(n, 36, 36), lower triangles row by row (see ``reduction.unpacked``): (n, 666)."""
    gradient: np.ndarray
    """(n, 36)"""
    dynamics: np.ndarray
    """dx_{k+1} = dynamics z + defect, (n, 24, 36)."""
    defect: np.ndarray
    """(n, 24)"""
    input_change: np.ndarray
    """du where z = 0, (n, 24)."""
    force_scale: np.ndarray
    """d(forces) = input_change[:12] + force_scale w, (n, 12)."""
    rate_map: np.ndarray
    """d(joint velocities) = input_change[12:] + rate_map z, (n, 12, 36)."""
    friction_rows: np.ndarray
    """friction_rows w_leg >= friction_bounds, (n, 4, ROWS, 3)."""
    friction_bounds: np.ndarray
    """(n, 4, ROWS)"""
    costs: np.ndarray
    """(n,)"""
    violations: np.ndarray
    """Squared: shooting defects and state-input equalities (the latter times the knot's duration), (n,)."""


def make_blocks(n: int) -> KnotBlocks:
    """Allocates blocks for n knots."""
    model = (PACKED,), (STAGE,), (STATES, STAGE), (STATES,)
    inputs = (INPUTS,), (NUM_JOINTS,), (NUM_JOINTS, STAGE)
    return KnotBlocks(*(np.zeros((n, *shape)) for shape in (*model, *inputs, (4, ROWS, 3), (4, ROWS), (), ())))


@njit(cache=True)
def _discrete_dynamics(tree, x, u, x_next, dt, f, a, b, work, dynamics, defect):
    """Midpoint rule (second-order Runge-Kutta) with its sensitivities, (24, 48); f, a, b hold the values at (x, u).

    Only the rates of angular momentum, base position and attitude depend on the state; those of the joints are inputs.
    """
    middle, f_mid, a_mid, b_mid = work
    states, inputs = b.shape
    for i in range(states):
        middle[i] = x[i] + 0.5 * dt * f[i]
    dynamics_derivatives(tree, middle, u, f_mid, a_mid, b_mid)
    for i in range(states):
        for j in range(states):
            dynamics[i, j] = dt * a_mid[i, j]
        for j in range(inputs):
            dynamics[i, states + j] = dt * b_mid[i, j]
        if ANGULAR <= i < JOINTS:
            for k in range(JOINTS):
                part = 0.5 * dt * dt * a_mid[i, k]
                for j in range(states):
                    dynamics[i, j] += part * a[k, j]
                for j in range(inputs):
                    dynamics[i, states + j] += part * b[k, j]
            for j in range(NUM_JOINTS):
                dynamics[i, states + JOINT_RATES + j] += 0.5 * dt * dt * a_mid[i, JOINTS + j]
        dynamics[i, i] += 1.0
        defect[i] = x[i] + dt * f_mid[i] - x_next[i]


@njit(cache=True)
def stage_cost(parameters, task, k, x, u, dt, feet, geometry, hessian, linear):
    """Adds all cost terms of knot k in [x; u]. Returns the cost."""
    p, v, p_x, v_x, v_u = feet
    rotation, rotation_angles, kinematics = geometry
    axes, origins, feet_b = kinematics[0], kinematics[1], kinematics[4]
    cost = add_tracking(
        x, u, task.x_ref[k], task.u_ref[k], parameters.state_weights, parameters.input_weights, dt, hessian, linear
    )
    cost += add_angular_momentum_tracking(x, task.x_ref[k], parameters.angular_momentum_weights, dt, hessian, linear)
    mu, delta = parameters.position_barrier
    lower, upper, first = parameters.position_lower, parameters.position_upper, JOINTS
    cost += add_box_limits(x[first:], lower, upper, mu, delta, dt, hessian[first:, first:], linear[first:])
    mu, delta = parameters.velocity_barrier
    lower, upper, first = parameters.velocity_lower, parameters.velocity_upper, STATES + JOINT_RATES
    cost += add_box_limits(u[JOINT_RATES:], lower, upper, mu, delta, dt, hessian[first:, first:], linear[first:])
    mu, delta = parameters.torque_barrier
    cost += add_torque_limits(
        u, rotation, rotation_angles, axes, origins, feet_b, parameters.torque_limits, mu, delta, dt, hessian, linear
    )
    mu, delta = parameters.foothold_barrier
    for leg in range(4):
        if task.stance[k, leg]:
            normals, offsets = task.halfspace_normals[k, leg], task.halfspace_offsets[k, leg]
            cost += add_foothold_region(leg, p[leg], p_x[leg], normals, offsets, mu, delta, dt, hessian, linear)
        else:  # where a stance foot is and how it moves is not up to the inputs, so it is not tracked
            cost += add_foot_tracking(
                leg,
                p[leg],
                v[leg],
                task.foot_ref_p[k, leg],
                task.foot_ref_v[k, leg],
                p_x[leg],
                v_x[leg],
                v_u[leg],
                parameters.foot_position_weights,
                parameters.foot_velocity_weights,
                dt,
                hessian,
                linear,
            )
    if task.distance.size > 0:
        ground, placed = (
            (task.distance, task.distance_origin, task.distance_step),
            (rotation, rotation_angles, axes, origins),
        )
        corners, radii, barrier = parameters.trunk_corners, parameters.clearance_radii, parameters.clearance_barrier
        cost += add_sdf_clearance(x, placed, ground, corners, radii, barrier, dt, hessian, linear)
    return cost


@njit(cache=True)
def input_constraints(parameters, task, k, u, dt, feet, change, by_state, by_rates, residual):
    """Collects the state-input equalities of knot k. Returns the number of velocity rows and the squared violation."""
    p, v, p_x, v_x, v_u = feet
    stance_gain = min(parameters.stance_gain, _MAX_GAIN_TIMES_STEP / dt)
    swing_gain = min(parameters.swing_gain, _MAX_GAIN_TIMES_STEP / dt)
    row, violation = np.int64(0), 0.0  # a plain 0 would have both functions below compiled for it alone
    direction = np.empty(3)
    change[:] = 0.0
    for leg in range(4):
        p_ref, v_ref = task.foot_ref_p[k, leg], task.foot_ref_v[k, leg]
        if task.stance[k, leg]:
            row = stance_foot(
                p[leg], v[leg], p_ref, p_x[leg], v_x[leg], v_u[leg], stance_gain, row, by_state, by_rates, residual
            )
            continue
        # Newtons weigh a hundredth of metres per second here, so that neither drowns the other.
        violation += zero_force(leg, u, change) / parameters.force_unit**2
        for i in range(parameters.swing_directions):
            for j in range(3):
                direction[j] = 1.0 if i == j else 0.0
                if parameters.swing_directions == 1:
                    direction[j] = task.surface_normal[k, leg, j]
            row = swing_foot(
                p[leg], v[leg], p_ref, v_ref, direction, p_x[leg], v_x[leg], v_u[leg], swing_gain, row, by_state, by_rates,
                residual,
            )  # fmt: skip
    for i in range(row):
        violation += residual[i] * residual[i]
    return row, violation


@njit(cache=True)
def _friction(parameters, task, k, u, rows, bounds):
    """Writes the friction polyhedra of knot k as rows on w."""
    for leg in range(4):
        if task.stance[k, leg]:
            friction_pyramid(vector(task.surface_normal[k, leg]), task.x_ref[k, YAW], task.friction, rows[leg])
            for i in range(ROWS):
                bounds[leg, i] = INNER * task.friction * parameters.min_normal_force
                for j in range(3):
                    bounds[leg, i] -= rows[leg, i, j] * u[3 * leg + j]
                    rows[leg, i, j] *= parameters.force_unit
        else:
            rows[leg] = 0.0
            bounds[leg] = INACTIVE_BOUND


@njit(cache=True, nogil=True)
def approximate_knots(parameters, task, states, inputs, blocks):
    """Fills ``blocks`` with the linear-quadratic approximation about states (n + 1, 24) and inputs (n, 24)."""
    f, a, b = np.empty(STATES), np.empty((STATES, STATES)), np.empty((STATES, INPUTS))
    work = np.empty(STATES), np.empty(STATES), np.empty((STATES, STATES)), np.empty((STATES, INPUTS))
    p, v = np.empty((4, 3)), np.empty((4, 3))
    p_x, v_x, v_u = np.empty((4, 3, STATES)), np.empty((4, 3, STATES)), np.empty((4, 3, INPUTS))
    feet = (p, v, p_x, v_x, v_u)
    hessian, linear = np.empty((STATES + INPUTS, STATES + INPUTS)), np.empty(STATES + INPUTS)
    dynamics = np.empty((STATES, STATES + INPUTS))
    by_state, by_rates, residual = np.empty((12, STATES)), np.empty((12, 12)), np.empty(12)
    free = np.empty(12, np.bool_)
    for k in range(len(inputs)):
        x, u, dt = states[k], inputs[k], task.times[k + 1] - task.times[k]
        defect, change, scale, rate_map = blocks.defect[k], blocks.input_change[k], blocks.force_scale[k], blocks.rate_map[k]
        geometry = knot_derivatives(parameters.tree, x, u, f, a, b, p, v, p_x, v_x, v_u)
        _discrete_dynamics(parameters.tree, x, u, states[k + 1], dt, f, a, b, work, dynamics, defect)
        hessian[:, :] = 0.0
        linear[:] = 0.0
        blocks.costs[k] = stage_cost(parameters, task, k, x, u, dt, feet, geometry, hessian, linear)
        rows, violation = input_constraints(parameters, task, k, u, dt, feet, change, by_state, by_rates, residual)
        violation *= dt
        for i in range(STATES):
            violation += defect[i] * defect[i]
        blocks.violations[k] = violation
        project_inputs(
            task.stance[k], rows, by_state, by_rates, residual, parameters.force_unit, change, scale, rate_map, free
        )
        _friction(parameters, task, k, u, blocks.friction_rows[k], blocks.friction_bounds[k])
        reduce_dynamics(scale, change, rate_map, dynamics, blocks.dynamics[k], defect)
        reduce_cost(scale, change, rate_map, free, hessian, linear, blocks.hessian[k], blocks.gradient[k])
