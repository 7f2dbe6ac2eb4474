"""Friction cone of a stance foot as a polyhedron in the frame of its surface (QuadPiPS eq. 19c): hard inequalities."""

import numpy as np
from numba import njit

from quadpips_drake.math.small_algebra import cross, dot, scale, subtract

FRICTION = 0.7
"""Friction coefficient that planning, MPC and whole-body control count on unless told otherwise [1]. Standing on the 28.2
degrees of the steepest worlds needs 0.54, and 0.68 while the base gains 1 m/s^2 uphill; the worlds have 1.0."""
ROWS = 6
"""Faces of the polyhedron. With eight an update of the MPC took 30 % longer than with four, with six a tenth."""
INNER = np.cos(np.pi / ROWS)
"""Distance of a face from the axis, as part of that of the corners, which lie on the cone."""
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
    """Writes the rows (ROWS, 3) of the polyhedron inside the cone |tangential part of f| <= friction * normal part of f:
    rows @ f >= 0. Each is friction cos(pi / ROWS) n minus a unit tangent; ``normal`` is a tuple.

    It touches the cone ahead, behind, and 60 degrees to either side of both; the least that it grants, to the sides, is 87 %
    of it. These directions follow the heading, so what a robot can do does not depend on where it faces.
    """
    first, second, n = surface_frame(normal, yaw)
    for k in range(len(rows)):
        angle = 2.0 * np.pi * (k + 0.5) / ROWS
        along, across = np.cos(angle), np.sin(angle)
        for i in range(3):
            rows[k, i] = friction * INNER * n[i] - along * first[i] - across * second[i]
