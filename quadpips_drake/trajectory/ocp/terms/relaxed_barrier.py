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
def add_linear_barrier(h, gradient, mu, delta, weight, hessian, linear):
    """Adds weight * B(h) to a quadratic model in z, where h has the given gradient by z. Returns the cost."""
    value, first, second = relaxed_barrier(h, mu, delta)
    n = len(gradient)
    for i in range(n):
        if gradient[i] != 0.0:
            linear[i] += weight * first * gradient[i]
            scaled = weight * second * gradient[i]
            for j in range(n):
                hessian[i, j] += scaled * gradient[j]
    return weight * value
