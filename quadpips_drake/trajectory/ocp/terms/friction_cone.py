"""Friction cone of a stance foot as a pyramid in the frame of its surface (QuadPiPS eq. 19c): a hard inequality."""

import numpy as np
from numba import njit

ROWS = 4
INACTIVE_BOUND = -1.0
"""Lower bound of the empty rows of a swinging foot: fulfilled with room to spare."""


@njit(cache=True)
def surface_frame(normal, yaw):
    """Returns a rotation matrix whose rows are two tangents and the unit ``normal``; the first tangent points to the heading
    ``yaw`` [rad] as far as possible."""
    frame = np.empty((3, 3))
    frame[2] = normal / np.sqrt(normal @ normal)
    first = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    if abs(first @ frame[2]) > 0.9:
        first[:] = 0.0
        first[2] = 1.0
    first -= (first @ frame[2]) * frame[2]
    frame[0] = first / np.sqrt(first @ first)
    frame[1] = np.cross(frame[2], frame[0])
    return frame


@njit(cache=True)
def friction_pyramid(normal, yaw, friction, rows):
    """Writes the rows (4, 3) with rows @ f >= 0  <=>  |tangential components of f| <= friction * normal component.

    The tangents follow the heading, so what a robot can do does not depend on where it faces. With the friction
    coefficient / sqrt(2) the pyramid lies inside the cone.
    """
    frame = surface_frame(normal, yaw)
    for i in range(2):
        rows[2 * i] = friction * frame[2] - frame[i]
        rows[2 * i + 1] = friction * frame[2] + frame[i]
