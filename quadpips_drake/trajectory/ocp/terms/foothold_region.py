"""A stance foot stays on its planar region: half-spaces as relaxed barriers (QuadPiPS eq. 19b)."""

import numpy as np
from numba import njit

from quadpips_drake.trajectory.ocp.terms.foot_columns import foot_columns
from quadpips_drake.trajectory.ocp.terms.relaxed_barrier import add_along, relaxed_barrier


@njit(cache=True)
def add_foothold_region(leg, p, p_x, normals, offsets, mu, delta, weight, hessian, linear):
    """Adds barriers on normals @ p + offsets >= 0, (m, 3) and (m,); rows of zeros are padding. Returns the cost.

    p, p_x: position of the leg's foot (3,) and its derivative by the state (3, 24).
    """
    cost = 0.0
    columns = foot_columns(leg)
    gradient = np.empty(len(columns))
    for i in range(len(offsets)):
        x, y, z = normals[i, 0], normals[i, 1], normals[i, 2]
        if x == 0.0 and y == 0.0 and z == 0.0:
            continue
        value, first, second = relaxed_barrier(x * p[0] + y * p[1] + z * p[2] + offsets[i], mu, delta)
        for j in range(len(columns)):
            column = columns[j]
            gradient[j] = x * p_x[0, column] + y * p_x[1, column] + z * p_x[2, column]
        add_along(gradient, columns, weight * first, weight * second, hessian, linear)
        cost += value
    return weight * cost
