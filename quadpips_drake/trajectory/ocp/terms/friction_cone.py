"""Friction cone of a stance foot as a pyramid in the frame of its surface (QuadPiPS eq. 19c): a hard inequality."""

import numpy as np
from numba import njit

from quadpips_drake.math.small_algebra import cross, dot, scale, subtract

ROWS = 4
INACTIVE_BOUND = -1.0
"""Lower bound of the empty rows of a swinging foot: fulfilled with room to spare."""


@njit(cache=True)
def surface_frame(normal, yaw):
    """Returns two tangents and the unit ``normal``, a tuple each: the rows of a rotation matrix. The first tangent points to
    the heading ``yaw`` [rad] as far as possible."""
    n = scale(1.0 / np.sqrt(dot(normal, normal)), normal)
    heading = (np.cos(yaw), np.sin(yaw), 0.0)
    if abs(dot(heading, n)) > 0.9:
        heading = (0.0, 0.0, 1.0)
    first = subtract(heading, scale(dot(heading, n), n))
    first = scale(1.0 / np.sqrt(dot(first, first)), first)
    return first, cross(n, first), n


@njit(cache=True)
def friction_pyramid(normal, yaw, friction, rows):
    """Writes the rows (4, 3) with rows @ f >= 0  <=>  |tangential components of f| <= friction * normal component.

    The tangents follow the heading, so what a robot can do does not depend on where it faces. With the friction
    coefficient / sqrt(2) the pyramid lies inside the cone.
    """
    first, second, n = surface_frame(normal, yaw)
    for i in range(3):
        rows[0, i], rows[1, i] = friction * n[i] - first[i], friction * n[i] + first[i]
        rows[2, i], rows[3, i] = friction * n[i] - second[i], friction * n[i] + second[i]
