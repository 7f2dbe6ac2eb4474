"""Linear-quadratic approximation of all knots of the optimal control problem, in one numba call."""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.robots.kinematic_tree import KinematicTree
from quadpips_drake.trajectory.centroidal.centroidal_derivatives import dynamics_derivatives, knot_derivatives
from quadpips_drake.trajectory.centroidal.centroidal_kernels import JOINT_RATES, JOINTS
from quadpips_drake.trajectory.ocp.projection import NUM_FREE, project_inputs
from quadpips_drake.trajectory.ocp.terms.foothold_region import add_foothold_region
from quadpips_drake.trajectory.ocp.terms.friction_cone import INACTIVE_BOUND, friction_pyramid
from quadpips_drake.trajectory.ocp.terms.joint_limits import add_box_limits, add_torque_limits
from quadpips_drake.trajectory.ocp.terms.stance_foot import stance_foot
from quadpips_drake.trajectory.ocp.terms.swing_foot import swing_foot
from quadpips_drake.trajectory.ocp.terms.tracking_cost import add_angular_momentum_tracking, add_foot_tracking, add_tracking
from quadpips_drake.trajectory.ocp.terms.zero_force import zero_force
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE, CentroidalState

STATES, INPUTS, FREE = STATE_SIZE, INPUT_SIZE, NUM_FREE
STAGE = STATES + FREE
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
    velocity_limits: np.ndarray
    torque_limits: np.ndarray
    stance_gain: float
    swing_gain: float
    swing_directions: int
    min_normal_force: float
    force_unit: float
    pyramid_friction: float


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


class KnotBlocks(NamedTuple):
    """Quadratic model of n knots in z = [dx; w] and what leads back to du."""

    hessian: np.ndarray
    """(n, 36, 36)"""
    gradient: np.ndarray
    """(n, 36)"""
    dynamics: np.ndarray
    """dx_{k+1} = dynamics z + defect, (n, 24, 36)."""
    defect: np.ndarray
    """(n, 24)"""
    input_map: np.ndarray
    """du = input_change + input_map z, (n, 24, 36)."""
    input_change: np.ndarray
    """(n, 24)"""
    friction_rows: np.ndarray
    """friction_rows w_leg >= friction_bounds, (n, 4, 4, 3)."""
    friction_bounds: np.ndarray
    """(n, 4, 4)"""
    costs: np.ndarray
    """(n,)"""
    violations: np.ndarray
    """Squared: shooting defects and state-input equalities (the latter times the knot's duration), (n,)."""


def make_blocks(n: int) -> KnotBlocks:
    """Allocates blocks for n knots."""
    shapes = ((n, STAGE, STAGE), (n, STAGE), (n, STATES, STAGE), (n, STATES), (n, INPUTS, STAGE), (n, INPUTS))
    return KnotBlocks(*(np.zeros(s) for s in (*shapes, (n, 4, 4, 3), (n, 4, 4), (n,), (n,))))


@njit(cache=True)
def _discrete_dynamics(tree, x, u, x_next, dt, f, a, b, dynamics, defect):
    """Midpoint rule (second-order Runge-Kutta) with its sensitivities, (24, 48); f, a, b hold the values at (x, u)."""
    f_mid, a_mid, b_mid = np.empty(STATES), np.empty((STATES, STATES)), np.empty((STATES, INPUTS))
    dynamics_derivatives(tree, x + 0.5 * dt * f, u, f_mid, a_mid, b_mid)
    dynamics[:, :STATES] = dt * a_mid + (0.5 * dt * dt) * (a_mid @ a)
    dynamics[:, STATES:] = dt * b_mid + (0.5 * dt * dt) * (a_mid @ b)
    for i in range(STATES):
        dynamics[i, i] += 1.0
        defect[i] = x[i] + dt * f_mid[i] - x_next[i]


@njit(cache=True)
def _stage_cost(parameters, task, k, x, u, dt, feet, geometry, hessian, linear):
    """Adds all cost terms of knot k in [x; u]. Returns the cost."""
    p, v, p_x, v_x, v_u = feet
    rotation, rotation_angles, kinematics = geometry
    axes, origins, feet_b = kinematics[0], kinematics[1], kinematics[4]
    cost = add_tracking(
        x, u, task.x_ref[k], task.u_ref[k], parameters.state_weights, parameters.input_weights, dt, hessian, linear
    )
    cost += add_angular_momentum_tracking(x, task.x_ref[k], parameters.angular_momentum_weights, dt, hessian, linear)
    mu, delta = parameters.position_barrier
    cost += add_box_limits(
        x[JOINTS:], parameters.position_lower, parameters.position_upper, mu, delta, dt, JOINTS, hessian, linear
    )
    mu, delta = parameters.velocity_barrier
    limits = parameters.velocity_limits
    cost += add_box_limits(u[JOINT_RATES:], -limits, limits, mu, delta, dt, STATES + JOINT_RATES, hessian, linear)
    mu, delta = parameters.torque_barrier
    cost += add_torque_limits(
        u, rotation, rotation_angles, axes, origins, feet_b, parameters.torque_limits, mu, delta, dt, hessian, linear
    )
    mu, delta = parameters.foothold_barrier
    for leg in range(4):
        if task.stance[k, leg]:
            normals, offsets = task.halfspace_normals[k, leg], task.halfspace_offsets[k, leg]
            cost += add_foothold_region(p[leg], p_x[leg], normals, offsets, mu, delta, dt, hessian, linear)
        else:  # where a stance foot is and how it moves is not up to the inputs, so it is not tracked
            cost += add_foot_tracking(
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
    return cost


@njit(cache=True)
def _input_constraints(parameters, task, k, u, dt, feet, change, by_state, by_rates, residual):
    """Collects the state-input equalities of knot k. Returns the number of velocity rows and the squared violation."""
    p, v, p_x, v_x, v_u = feet
    stance_gain = min(parameters.stance_gain, _MAX_GAIN_TIMES_STEP / dt)
    swing_gain = min(parameters.swing_gain, _MAX_GAIN_TIMES_STEP / dt)
    row, violation = 0, 0.0
    direction = np.zeros(3)
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
            if parameters.swing_directions == 1:
                direction[:] = task.surface_normal[k, leg]
            else:
                direction[:] = 0.0
                direction[i] = 1.0
            row = swing_foot(
                p[leg], v[leg], p_ref, v_ref, direction, p_x[leg], v_x[leg], v_u[leg], swing_gain, row, by_state, by_rates,
                residual,
            )  # fmt: skip
    for i in range(row):
        violation += residual[i] * residual[i]
    return row, violation


@njit(cache=True)
def _friction(parameters, task, k, u, rows, bounds):
    """Writes the friction pyramids of knot k as rows on w."""
    slope = task.friction * parameters.pyramid_friction
    for leg in range(4):
        if task.stance[k, leg]:
            friction_pyramid(task.surface_normal[k, leg], task.x_ref[k, YAW], slope, rows[leg])
            bounds[leg] = slope * parameters.min_normal_force - rows[leg] @ u[3 * leg : 3 * leg + 3]
            rows[leg] *= parameters.force_unit
        else:
            rows[leg] = 0.0
            bounds[leg] = INACTIVE_BOUND


@njit(cache=True)
def approximate_knots(parameters, task, states, inputs, blocks):
    """Fills ``blocks`` with the linear-quadratic approximation about states (n + 1, 24) and inputs (n, 24)."""
    f, a, b = np.empty(STATES), np.empty((STATES, STATES)), np.empty((STATES, INPUTS))
    p, v = np.empty((4, 3)), np.empty((4, 3))
    p_x, v_x, v_u = np.empty((4, 3, STATES)), np.empty((4, 3, STATES)), np.empty((4, 3, INPUTS))
    hessian, linear = np.empty((STATES + INPUTS, STATES + INPUTS)), np.empty(STATES + INPUTS)
    dynamics = np.empty((STATES, STATES + INPUTS))
    by_state, by_rates, residual = np.empty((12, STATES)), np.empty((12, 12)), np.empty(12)
    full_map, offset = np.zeros((STATES + INPUTS, STAGE)), np.zeros(STATES + INPUTS)
    free = np.empty(FREE, np.bool_)
    for i in range(STATES):
        full_map[i, i] = 1.0
    for k in range(len(inputs)):
        x, u, dt = states[k], inputs[k], task.times[k + 1] - task.times[k]
        geometry = knot_derivatives(parameters.tree, x, u, f, a, b, p, v, p_x, v_x, v_u)
        feet = (p, v, p_x, v_x, v_u)
        defect, change = blocks.defect[k], blocks.input_change[k]
        _discrete_dynamics(parameters.tree, x, u, states[k + 1], dt, f, a, b, dynamics, defect)
        hessian[:, :] = 0.0
        linear[:] = 0.0
        blocks.costs[k] = _stage_cost(parameters, task, k, x, u, dt, feet, geometry, hessian, linear)
        change[:] = 0.0
        rows, violation = _input_constraints(parameters, task, k, u, dt, feet, change, by_state, by_rates, residual)
        blocks.violations[k] = defect @ defect + dt * violation
        project_inputs(
            task.stance[k], rows, by_state, by_rates, residual, parameters.force_unit, change, blocks.input_map[k], free
        )
        _friction(parameters, task, k, u, blocks.friction_rows[k], blocks.friction_bounds[k])
        full_map[STATES:] = blocks.input_map[k]
        offset[STATES:] = change
        blocks.dynamics[k] = dynamics @ full_map
        defect += dynamics @ offset
        blocks.gradient[k] = full_map.T @ (linear + hessian @ offset)
        blocks.hessian[k] = full_map.T @ (hessian @ full_map)
        for i in range(FREE):
            if not free[i]:  # an entry of w without effect: any curvature will do
                blocks.hessian[k, STATES + i, STATES + i] = 1.0
