"""Samples between samples."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def interpolated(times, knots, values):
    """``values`` (m, n), given at the increasing ``knots`` (m,), at the increasing ``times`` (k,): linear in between,
    constant outside; (k, n)."""
    last, size = len(knots) - 1, values.shape[1]
    out = np.empty((len(times), size))
    right = 1
    for k in range(len(times)):
        while right < last and knots[right] <= times[k]:
            right += 1
        part = (times[k] - knots[right - 1]) / (knots[right] - knots[right - 1])
        part = min(max(part, 0.0), 1.0)
        for i in range(size):
            out[k, i] = (1.0 - part) * values[right - 1, i] + part * values[right, i]
    return out


@njit(cache=True)
def interpolate_at(time, knots, values, out):
    """As ``interpolated`` at one ``time``, into ``out`` (n,). Returns the index of the interval."""
    k = 0
    while k < len(knots) - 2 and knots[k + 1] <= time:
        k += 1
    part = (time - knots[k]) / (knots[k + 1] - knots[k])
    part = min(max(part, 0.0), 1.0)
    for i in range(values.shape[1]):
        out[i] = (1.0 - part) * values[k, i] + part * values[k + 1, i]
    return k
