"""Tracking cost ||x - x_des||_Q^2 + ||u - u_des||_R^2 and its counterpart for swinging feet (QuadPiPS eq. 19)."""

import numpy as np
from numba import njit

from quadpips_drake.trajectory.centroidal.centroidal_kernels import ANGULAR, JOINT_RATES
from quadpips_drake.trajectory.ocp.terms.foot_columns import foot_columns
from quadpips_drake.trajectory.ocp.terms.relaxed_barrier import add_along
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE, CentroidalState

YAW = CentroidalState.YAW


@njit(cache=True)
def add_tracking(x, u, x_ref, u_ref, state_weights, input_weights, weight, hessian, linear):
    """Adds weight / 2 (|x - x_ref|_Q^2 + |u - u_ref|_R^2) with diagonal Q, R. Returns the cost."""
    cost, n = 0.0, len(x)
    for i in range(n):
        error = x[i] - x_ref[i]
        cost += 0.5 * state_weights[i] * error * error
        linear[i] += weight * state_weights[i] * error
        hessian[i, i] += weight * state_weights[i]
    for i in range(len(u)):
        error = u[i] - u_ref[i]
        cost += 0.5 * input_weights[i] * error * error
        linear[n + i] += weight * input_weights[i] * error
        hessian[n + i, n + i] += weight * input_weights[i]
    return weight * cost


@njit(cache=True)
def add_angular_momentum_tracking(x, x_ref, weights, weight, hessian, linear):
    """Adds the cost of angular momentum about the horizontal axes, whose weights (2,) differ: roll and pitch of the robot,
    so they belong to the axes of the reference's heading. Returns the cost."""
    c, s = np.cos(x_ref[YAW]), np.sin(x_ref[YAW])
    xx = weight * (c * c * weights[0] + s * s * weights[1])
    yy = weight * (s * s * weights[0] + c * c * weights[1])
    xy = weight * c * s * (weights[0] - weights[1])
    i, j = ANGULAR, ANGULAR + 1
    ex, ey = x[i] - x_ref[i], x[j] - x_ref[j]
    linear[i] += xx * ex + xy * ey
    linear[j] += xy * ex + yy * ey
    hessian[i, i] += xx
    hessian[j, j] += yy
    hessian[i, j] += xy
    hessian[j, i] += xy
    return 0.5 * (xx * ex * ex + yy * ey * ey) + xy * ex * ey


@njit(cache=True)
def add_foot_tracking(leg, p, v, p_ref, v_ref, p_x, v_x, v_u, position_weights, velocity_weights, weight, hessian, linear):
    """Adds weight / 2 (|p - p_ref|^2 + |v - v_ref|^2) for one foot, Gauss-Newton with its Jacobians. Returns the cost."""
    cost = 0.0
    columns = foot_columns(leg)
    gradient = np.empty(len(columns))
    for i in range(3):
        error, stiffness = p[i] - p_ref[i], weight * position_weights[i]
        cost += 0.5 * stiffness * error * error
        for j in range(len(columns)):
            gradient[j] = p_x[i, columns[j]]
        add_along(gradient, columns, stiffness * error, stiffness, hessian, linear)
    jacobian = np.zeros((3, STATE_SIZE + INPUT_SIZE))
    for i in range(3):
        error, stiffness = v[i] - v_ref[i], weight * velocity_weights[i]
        cost += 0.5 * stiffness * error * error
        for j in range(STATE_SIZE):
            jacobian[i, j] = v_x[i, j]
        for j in range(JOINT_RATES, INPUT_SIZE):
            jacobian[i, STATE_SIZE + j] = v_u[i, j]
        for j in range(STATE_SIZE + INPUT_SIZE):
            linear[j] += stiffness * error * jacobian[i, j]
    for row in range(STATE_SIZE + INPUT_SIZE):
        x, y, z = jacobian[0, row], jacobian[1, row], jacobian[2, row]
        if x == 0.0 and y == 0.0 and z == 0.0:
            continue
        x, y, z = weight * velocity_weights[0] * x, weight * velocity_weights[1] * y, weight * velocity_weights[2] * z
        for j in range(STATE_SIZE + INPUT_SIZE):
            hessian[row, j] += x * jacobian[0, j] + y * jacobian[1, j] + z * jacobian[2, j]
    return cost
