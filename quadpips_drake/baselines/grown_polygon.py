"""The polygon in which a foot may come down: a small one around its foothold that grows inside the region."""

import numpy as np
from numba import njit

from quadpips_drake.math.polygons import distance_inside

_LEAST = 1e-3
"""Of the first circle's radius [m]: a foothold closer to the border than this has no polygon."""
_FLAT = 1e-12
"""Turns of a convex polygon may be as negative as this by rounding [m^2]."""


@njit(cache=True)
def grown_polygon(boundary, x, y, vertices, growth):
    """Returns a convex polygon (n, 2), counter-clockwise, inside the convex ``boundary`` (m, 2) and around (x, y).

    It begins as a regular polygon in the largest circle about (x, y); then its vertices are moved away from (x, y) in turn,
    each by the factor ``growth`` at a time, as long as the polygon stays convex and inside. Empty if (x, y) is outside or
    as good as on the border.
    """
    radius = distance_inside(boundary, x, y)
    if radius < _LEAST:
        return np.empty((0, 2))
    polygon = np.empty((vertices, 2))
    for i in range(vertices):
        angle = 2.0 * np.pi * i / vertices
        polygon[i, 0], polygon[i, 1] = x + radius * np.cos(angle), y + radius * np.sin(angle)
    moved = True
    while moved:
        moved = False
        for i in range(vertices):
            old_x, old_y = polygon[i, 0], polygon[i, 1]
            polygon[i, 0], polygon[i, 1] = x + growth * (old_x - x), y + growth * (old_y - y)
            if distance_inside(boundary, polygon[i, 0], polygon[i, 1]) >= 0.0 and _convex_about(polygon, i):
                moved = True
            else:
                polygon[i, 0], polygon[i, 1] = old_x, old_y
    return polygon


@njit(cache=True)
def _convex_about(polygon, i):
    """Whether a polygon turns left at vertex ``i`` and at both of its neighbours."""
    n = len(polygon)
    for k in range(i - 1, i + 2):
        a, b, c = polygon[(k - 1) % n], polygon[k % n], polygon[(k + 1) % n]
        if (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) < -_FLAT:
            return False
    return True
