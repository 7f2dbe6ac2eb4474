"""A quadruped's kinematic tree as plain arrays, for numba code that cannot hold a MultibodyPlant."""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.math.small_algebra import cross, subtract, times


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
    rotations, origins = np.zeros((13, 3, 3)), np.zeros((13, 3))
    for i in range(3):
        rotations[0, i, i] = 1.0
    for j in range(12):
        link, parent = 1 + j, 0 if j % 3 == 0 else j
        turn = axis_rotation(joint_axis[j], q[j])
        for row in range(3):
            origins[link, row] = origins[parent, row]
            for k in range(3):
                origins[link, row] += rotations[parent, row, k] * joint_offset[j, k]
                for column in range(3):
                    rotations[link, row, column] += rotations[parent, row, k] * turn[k, column]
    return rotations, origins


@njit(cache=True)
def _feet(rotations, origins, foot_offset):
    feet = np.empty((4, 3))
    for leg in range(4):
        shank = 3 * leg + 3
        for row in range(3):
            feet[leg, row] = origins[shank, row]
            for k in range(3):
                feet[leg, row] += rotations[shank, row, k] * foot_offset[leg, k]
    return feet


@njit(cache=True)
def foot_positions_B(joint_axis, joint_offset, foot_offset, q):
    """Returns the foot points F in the base frame (4, 3) at joint angles ``q`` (12,)."""
    rotations, origins = link_poses_B(joint_axis, joint_offset, q)
    return _feet(rotations, origins, foot_offset)


@njit(cache=True)
def foot_jacobians_B(joint_axis, joint_offset, foot_offset, q):
    """Returns d p_BF / d q_leg (4, 3, 3): column i belongs to the leg's joint i (HAA, HFE, KFE)."""
    rotations, origins = link_poses_B(joint_axis, joint_offset, q)
    feet, jacobians = _feet(rotations, origins, foot_offset), np.empty((4, 3, 3))
    for leg in range(4):
        for i in range(3):
            link, joint = 3 * leg + 1 + i, 3 * leg + i
            axis = times(rotations[link], joint_axis[joint])
            column = cross(axis, subtract(feet[leg], origins[link]))
            for row in range(3):
                jacobians[leg, row, i] = column[row]
    return jacobians
