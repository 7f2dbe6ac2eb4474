"""The relaxed logarithmic barrier that turns inequalities into cost, so that the quadratic program always has a solution."""

import numpy as np
from numba import njit


@njit(cache=True)
def relaxed_barrier(h, mu, delta):
    """Returns the penalty B on h >= 0, its first and its second derivative (Hauser and Saccon, CDC 2006).

    B = -mu ln(h) for h > delta, else mu (-ln(delta) + ((h - 2 delta) / delta)^2 / 2 - 1/2): twice differentiable, convex.
    """
    if h > delta:
        return -mu * np.log(h), -mu / h, mu / (h * h)
    z = (h - 2.0 * delta) / delta
    return mu * (-np.log(delta) + 0.5 * z * z - 0.5), mu * z / delta, mu / (delta * delta)


@njit(cache=True)
def add_along(gradient, columns, first, second, hessian, linear):
    """Adds a cost that depends on one number h alone to a quadratic model.

    Args:
        gradient, columns: derivatives of h that are not zero, and by which variables they are, (m,) each.
        first, second: derivatives of the cost by h.
        hessian, linear: the quadratic model.
    """
    for i in range(len(columns)):
        row, slope = columns[i], second * gradient[i]
        linear[row] += first * gradient[i]
        for j in range(len(columns)):
            hessian[row, columns[j]] += slope * gradient[j]
