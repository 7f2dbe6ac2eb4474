"""Trilinear interpolation on a regular grid, with its gradient; in numba."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def trilinear(samples, origin, step, x, y, z):
    """Returns (inside, value, d/dx, d/dy, d/dz) at (x, y, z).

    Args:
        samples: float32 (n, m, k); ``samples[0, 0, 0]`` lies at ``origin`` (3,), its neighbours ``step`` further.
        origin, step: see there.
        x, y, z: where. Outside of the samples all is zero and ``inside`` False.
    """
    a, b, c = (x - origin[0]) / step, (y - origin[1]) / step, (z - origin[2]) / step
    n, m, k = samples.shape
    if not (a >= 0.0 and b >= 0.0 and c >= 0.0 and a <= n - 1 and b <= m - 1 and c <= k - 1):
        return False, 0.0, 0.0, 0.0, 0.0
    i, j, h = min(int(a), n - 2), min(int(b), m - 2), min(int(c), k - 2)
    if i < 0 or j < 0 or h < 0:  # a single layer
        return False, 0.0, 0.0, 0.0, 0.0
    a, b, c = a - i, b - j, c - h
    s000, s001 = np.float64(samples[i, j, h]), np.float64(samples[i, j, h + 1])
    s010, s011 = np.float64(samples[i, j + 1, h]), np.float64(samples[i, j + 1, h + 1])
    s100, s101 = np.float64(samples[i + 1, j, h]), np.float64(samples[i + 1, j, h + 1])
    s110, s111 = np.float64(samples[i + 1, j + 1, h]), np.float64(samples[i + 1, j + 1, h + 1])
    # Along z, then y, then x.
    s00, s01 = s000 + c * (s001 - s000), s010 + c * (s011 - s010)
    s10, s11 = s100 + c * (s101 - s100), s110 + c * (s111 - s110)
    s0, s1 = s00 + b * (s01 - s00), s10 + b * (s11 - s10)
    by_y = (1.0 - a) * (s01 - s00) + a * (s11 - s10)
    by_z = (1.0 - a) * ((1.0 - b) * (s001 - s000) + b * (s011 - s010))
    by_z += a * ((1.0 - b) * (s101 - s100) + b * (s111 - s110))
    return True, s0 + a * (s1 - s0), (s1 - s0) / step, by_y / step, by_z / step
