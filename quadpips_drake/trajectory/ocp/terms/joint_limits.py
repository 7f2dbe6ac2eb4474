"""Joint position, velocity and torque limits (QuadPiPS eq. 19e, 19f) as relaxed barriers in the cost."""

import numpy as np
from numba import njit

from quadpips_drake.math.small_algebra import cross, dot, subtract, transpose_times, vector
from quadpips_drake.trajectory.centroidal.centroidal_kernels import ANGLES, JOINTS
from quadpips_drake.trajectory.ocp.terms.relaxed_barrier import add_linear_barrier, relaxed_barrier
from quadpips_drake.values.centroidal import STATE_SIZE


@njit(cache=True)
def add_box_limits(values, lower, upper, mu, delta, weight, offset, hessian, linear):
    """Adds barriers on lower <= values <= upper, the variables ``offset``... of the quadratic model. Returns the cost."""
    cost = 0.0
    for j in range(len(values)):
        below, below_first, below_second = relaxed_barrier(values[j] - lower[j], mu, delta)
        above, above_first, above_second = relaxed_barrier(upper[j] - values[j], mu, delta)
        cost += below + above
        linear[offset + j] += weight * (below_first - above_first)
        hessian[offset + j, offset + j] += weight * (below_second + above_second)
    return weight * cost


@njit(cache=True)
def add_torque_limits(u, rotation, rotation_angles, axes, origins, feet, limits, mu, delta, weight, hessian, linear):
    """Adds barriers on |tau_j| <= limit with tau = -J^T f, the torque that holds the foot force. Returns the cost.

    Weight and inertia of the leg itself are neglected. axes, origins, feet are in B; the state comes first in the model.
    """
    cost = 0.0
    gradient = np.zeros(len(linear))
    for leg in range(4):
        force = vector(u[3 * leg :])
        if force[0] == 0.0 and force[1] == 0.0 and force[2] == 0.0:
            continue
        force_b, foot, first = transpose_times(rotation, force), vector(feet[leg]), 3 * leg
        for j in range(first, first + 3):
            column = cross(axes[j], subtract(foot, origins[j]))
            torque = -dot(column, force_b)
            gradient[:] = 0.0
            for i in range(3):
                gradient[ANGLES + i] = -dot(column, transpose_times(rotation_angles[i], force))
                gradient[STATE_SIZE + first + i] = -dot(rotation[i], column)
            for i in range(first, first + 3):
                if i <= j:
                    bent = cross(axes[i], column)
                else:
                    bent = cross(axes[j], cross(axes[i], subtract(foot, origins[i])))
                gradient[JOINTS + i] = -dot(bent, force_b)
            cost += add_linear_barrier(limits[j] + torque, gradient, mu, delta, weight, hessian, linear)
            cost += add_linear_barrier(limits[j] - torque, -gradient, mu, delta, weight, hessian, linear)
    return cost
