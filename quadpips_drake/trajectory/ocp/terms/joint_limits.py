"""Joint position, velocity and torque limits (QuadPiPS eq. 19e, 19f) as relaxed barriers in the cost."""

import numpy as np
from numba import njit

from quadpips_drake.math.small_algebra import cross, dot, subtract, transpose_times, vector
from quadpips_drake.trajectory.centroidal.centroidal_kernels import ANGLES, JOINTS
from quadpips_drake.trajectory.ocp.terms.relaxed_barrier import add_along, relaxed_barrier
from quadpips_drake.values.centroidal import STATE_SIZE


@njit(cache=True)
def add_box_limits(values, lower, upper, mu, delta, weight, hessian, linear):
    """Adds barriers on lower <= values <= upper, the first variables of the quadratic model. Returns the cost."""
    cost = 0.0
    for j in range(len(lower)):
        below, below_first, below_second = relaxed_barrier(values[j] - lower[j], mu, delta)
        above, above_first, above_second = relaxed_barrier(upper[j] - values[j], mu, delta)
        cost += below + above
        linear[j] += weight * (below_first - above_first)
        hessian[j, j] += weight * (below_second + above_second)
    return weight * cost


@njit(cache=True)
def add_torque_limits(u, rotation, rotation_angles, axes, origins, feet, limits, mu, delta, weight, hessian, linear):
    """Adds barriers on |tau_j| <= limit with tau = -J^T f, the torque that holds the foot force. Returns the cost.

    Weight and inertia of the leg itself are neglected. axes, origins, feet are in B; the state comes first in the model.
    """
    cost = 0.0
    gradient, columns = np.empty(9), np.empty(9, np.int64)  # by attitude, the leg's joints and its force
    for leg in range(4):
        first = 3 * leg
        force = vector(u[first:])
        if force[0] == 0.0 and force[1] == 0.0 and force[2] == 0.0:
            continue
        force_b, foot = transpose_times(rotation, force), vector(feet[leg])
        for i in range(3):
            columns[i], columns[3 + i], columns[6 + i] = ANGLES + i, JOINTS + first + i, STATE_SIZE + first + i
        for j in range(first, first + 3):
            column = cross(axes[j], subtract(foot, origins[j]))
            torque = -dot(column, force_b)
            for i in range(3):
                gradient[i] = -dot(column, transpose_times(rotation_angles[i], force))
                gradient[6 + i] = -dot(rotation[i], column)
                if first + i <= j:
                    bent = cross(axes[first + i], column)
                else:
                    bent = cross(axes[j], cross(axes[first + i], subtract(foot, origins[first + i])))
                gradient[3 + i] = -dot(bent, force_b)
            below, below_first, below_second = relaxed_barrier(limits[j] + torque, mu, delta)
            above, above_first, above_second = relaxed_barrier(limits[j] - torque, mu, delta)
            cost += below + above
            slope, curvature = weight * (below_first - above_first), weight * (below_second + above_second)
            add_along(gradient, columns, slope, curvature, hessian, linear)
    return weight * cost
