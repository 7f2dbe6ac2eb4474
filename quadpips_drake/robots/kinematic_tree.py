"""A quadruped's kinematic tree as plain arrays, for numba code that cannot hold a MultibodyPlant."""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.math.small_algebra import cross, subtract, vector


class KinematicTree(NamedTuple):
    """Thirteen links: link 0 is the base B, link 1 + j is moved by joint j. At q = 0 all link frames are parallel to B.

    All arrays are float64 and C-contiguous; lengths in m, masses in kg.
    """

    joint_axis: np.ndarray
    """Axis of each joint, in the frame of its child (the same in its parent's), unit, (12, 3)."""
    joint_offset: np.ndarray
    """Origin of each joint in its parent's link frame, (12, 3)."""
    foot_offset: np.ndarray
    """Foot point F (centre of the foot's sphere) in the shank's link frame, (4, 3)."""
    link_mass: np.ndarray
    """(13,)."""
    link_com: np.ndarray
    """Centre of mass in the link frame, (13, 3)."""
    link_inertia: np.ndarray
    """Rotational inertia about the centre of mass in the link frame [kg m^2], (13, 3, 3)."""


@njit(cache=True)
def axis_rotation(axis, angle):
    """Returns the rotation matrix (3, 3) about the unit ``axis`` by ``angle`` [rad] (Rodrigues' formula)."""
    x, y, z = axis[0], axis[1], axis[2]
    c, s = np.cos(angle), np.sin(angle)
    d = 1.0 - c
    rotation = np.empty((3, 3))
    rotation[0, 0], rotation[0, 1], rotation[0, 2] = c + d * x * x, d * x * y - s * z, d * x * z + s * y
    rotation[1, 0], rotation[1, 1], rotation[1, 2] = d * x * y + s * z, c + d * y * y, d * y * z - s * x
    rotation[2, 0], rotation[2, 1], rotation[2, 2] = d * x * z - s * y, d * y * z + s * x, c + d * z * z
    return rotation


@njit(cache=True)
def link_poses_B(joint_axis, joint_offset, q):
    """Returns the rotations (13, 3, 3) and origins (13, 3) of all links in the base frame at joint angles ``q`` (12,)."""
    rotations = np.zeros((13, 3, 3))
    origins = np.zeros((13, 3))
    for k in range(3):
        rotations[0, k, k] = 1.0
    for j in range(12):
        parent = 0 if j % 3 == 0 else j
        # Into the results at once: to assign an array to a part of one takes numba seconds to compile.
        np.dot(rotations[parent], axis_rotation(joint_axis[j], q[j]), rotations[1 + j])
        _add_rotated(origins[parent], rotations[parent], joint_offset[j], origins[1 + j])
    return rotations, origins


@njit(cache=True)
def _add_rotated(origin, rotation, offset, out):
    """Writes ``origin`` + ``rotation`` @ ``offset`` into ``out`` (3,)."""
    rotated = rotation @ offset
    for k in range(3):
        out[k] = origin[k] + rotated[k]


@njit(cache=True)
def foot_positions_B(joint_axis, joint_offset, foot_offset, q):
    """Returns the foot points F in the base frame (4, 3) at joint angles ``q`` (12,)."""
    rotations, origins = link_poses_B(joint_axis, joint_offset, q)
    feet = np.empty((4, 3))
    for leg in range(4):
        shank = 3 * leg + 3
        _add_rotated(origins[shank], rotations[shank], foot_offset[leg], feet[leg])
    return feet


@njit(cache=True)
def foot_jacobians_B(joint_axis, joint_offset, foot_offset, q):
    """Returns d p_BF / d q_leg (4, 3, 3): column i belongs to the leg's joint i (HAA, HFE, KFE)."""
    rotations, origins = link_poses_B(joint_axis, joint_offset, q)
    jacobians = np.empty((4, 3, 3))
    foot = np.empty(3)
    for leg in range(4):
        shank = 3 * leg + 3
        _add_rotated(origins[shank], rotations[shank], foot_offset[leg], foot)
        for i in range(3):
            link = 3 * leg + 1 + i
            axis = rotations[link] @ joint_axis[3 * leg + i]
            column = cross(vector(axis), subtract(vector(foot), vector(origins[link])))
            for k in range(3):
                jacobians[leg, k, i] = column[k]
    return jacobians
