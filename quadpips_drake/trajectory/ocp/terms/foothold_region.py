"""A stance foot stays on its planar region: half-spaces as relaxed barriers (QuadPiPS eq. 19b)."""

import numpy as np
from numba import njit

from quadpips_drake.trajectory.ocp.terms.relaxed_barrier import add_linear_barrier


@njit(cache=True)
def add_foothold_region(p, p_x, normals, offsets, mu, delta, weight, hessian, linear):
    """Adds barriers on normals @ p + offsets >= 0, (m, 3) and (m,); rows of zeros are padding. Returns the cost."""
    cost = 0.0
    gradient = np.zeros(len(linear))
    for i in range(len(offsets)):
        a = normals[i]
        if a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0:
            continue
        gradient[: p_x.shape[1]] = a[0] * p_x[0] + a[1] * p_x[1] + a[2] * p_x[2]
        h = a[0] * p[0] + a[1] * p[1] + a[2] * p[2] + offsets[i]
        cost += add_linear_barrier(h, gradient, mu, delta, weight, hessian, linear)
    return cost
