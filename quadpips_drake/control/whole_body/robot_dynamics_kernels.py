"""Rigid-body dynamics of a quadruped's tree in numba: mass matrix, bias forces and feet in one pass, some 10 us.

Everything is expressed in the world's axes, moments are taken about the base origin. Each link contributes its momentum for
unit velocities to the mass matrix (M = sum m J_c^T J_c + J_w^T I J_w), and its force and moment at vdot = 0 to the bias
(recursive Newton-Euler: R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 5). Legs touch each other only
through the base, so joints of different legs do not couple.
"""

import numpy as np
from numba import njit

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.small_algebra import (
    add,
    cross,
    dot,
    scale,
    store,
    store_matrix,
    subtract,
    times,
    transpose_times,
    vector,
)
from quadpips_drake.robots.kinematic_tree import axis_rotation


@njit(cache=True)
def _unit(i):
    return (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)


@njit(cache=True)
def _product(a, b):
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return out


@njit(cache=True)
def _spin(rotation, inertia, w):
    """Angular momentum R I R^T w of a link about its centre of mass, in W."""
    return times(rotation, times(inertia, transpose_times(rotation, w)))


@njit(cache=True)
def _add_locked(mass_matrix, m, c, rotation, inertia):
    """Adds a link to the block of the mass matrix that belongs to the base: the robot with locked joints."""
    for i in range(3):
        unit = _unit(i)
        linear = scale(m, cross(unit, c))
        angular = add(_spin(rotation, inertia, unit), cross(c, linear))
        for k in range(3):
            mass_matrix[k, i] += angular[k]
            mass_matrix[3 + k, i] += linear[k]
            mass_matrix[i, 3 + k] += linear[k]
        mass_matrix[3 + i, 3 + i] += m


@njit(cache=True)
def _moving(w, dw, arm):
    """Acceleration of a point at ``arm`` on a body that turns with w and is accelerated by dw."""
    return add(cross(dw, arm), cross(w, cross(w, arm)))


@njit(cache=True)
def dynamics_terms(tree, rotor_inertia, p_WB, R_WB, q, v, M, bias, J, foot_bias, p_WF, v_WF):
    """Fills mass matrix (18, 18), bias (18,), foot Jacobian (12, 18), foot bias (12,), feet and their velocities (4, 3).

    Args:
        tree: KinematicTree.
        rotor_inertia: reflected inertia of the drives [kg m^2], (12,).
        p_WB, R_WB: pose of the base.
        q: joint angles (12,).
        v: [w_WB, v_WB, joint velocities], (18,).
        M, bias, J, foot_bias, p_WF, v_WF: are filled.
    """
    M[:], bias[:], J[:] = 0.0, 0.0, 0.0
    base_w, base_v, zero = vector(v[:3]), vector(v[3:6]), (0.0, 0.0, 0.0)
    rotations, coms = np.empty((3, 3, 3)), np.empty((3, 3))
    forces, moments = np.empty((3, 3)), np.empty((3, 3))
    axes, origins = np.empty((3, 3)), np.empty((3, 3))
    for leg in range(-1, 4):
        rotation, origin, w, dw, acceleration = R_WB.copy(), zero, base_w, zero, zero
        for i in range(1 if leg < 0 else 3):
            link = 0 if leg < 0 else 3 * leg + 1 + i
            if leg >= 0:
                j = link - 1
                arm = times(rotation, tree.joint_offset[j])
                acceleration = add(acceleration, _moving(w, dw, arm))
                origin = add(origin, arm)
                axis = times(rotation, tree.joint_axis[j])
                rate = scale(v[6 + j], axis)
                dw = add(dw, cross(w, rate))
                w = add(w, rate)
                rotation = _product(rotation, axis_rotation(tree.joint_axis[j], q[j]))
                store(axes[i], axis)
                store(origins[i], origin)
            arm = times(rotation, tree.link_com[link])
            c, m, inertia = add(origin, arm), tree.link_mass[link], tree.link_inertia[link]
            force = scale(m, add(add(acceleration, _moving(w, dw, arm)), (0.0, 0.0, GRAVITY)))
            moment = add(_spin(rotation, inertia, dw), cross(w, _spin(rotation, inertia, w)))
            store(bias[:3], add(vector(bias[:3]), add(moment, cross(c, force))))
            store(bias[3:6], add(vector(bias[3:6]), force))
            _add_locked(M, m, c, rotation, inertia)
            store_matrix(rotations[i], rotation)
            store(coms[i], c)
            store(forces[i], force)
            store(moments[i], moment)
        if leg >= 0:
            _add_leg(M, bias, tree, leg, axes, origins, rotations, coms, forces, moments)
            arm = times(rotation, tree.foot_offset[leg])
            foot = add(origin, arm)
            store(foot_bias[3 * leg :], add(acceleration, _moving(w, dw, arm)))
            velocity = _foot_jacobian(J, leg, foot, axes, origins, base_w, base_v, v)
            store(v_WF[leg], velocity)
            store(p_WF[leg], add(vector(p_WB), foot))
    for j in range(12):
        M[6 + j, 6 + j] += rotor_inertia[j]


@njit(cache=True)
def _add_leg(M, bias, tree, leg, axes, origins, rotations, coms, forces, moments):
    """Rows and columns of one leg's joints in mass matrix and bias."""
    for i in range(3):
        axis, origin, row = vector(axes[i]), vector(origins[i]), 6 + 3 * leg + i
        linear, angular, load = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for k in range(i, 3):  # the links that joint i moves
            link, c = 3 * leg + 1 + k, vector(coms[k])
            p = scale(tree.link_mass[link], cross(axis, subtract(c, origin)))
            linear = add(linear, p)
            angular = add(angular, add(_spin(rotations[k], tree.link_inertia[link], axis), cross(c, p)))
            load = add(load, add(vector(moments[k]), cross(subtract(c, origin), vector(forces[k]))))
        bias[row] = dot(axis, load)
        for k in range(3):
            M[k, row] = M[row, k] = angular[k]
            M[3 + k, row] = M[row, 3 + k] = linear[k]
        for k in range(i + 1):
            other = 6 + 3 * leg + k
            entry = dot(vector(axes[k]), subtract(angular, cross(vector(origins[k]), linear)))
            M[other, row] = M[row, other] = entry


@njit(cache=True)
def _foot_jacobian(J, leg, foot, axes, origins, base_w, base_v, v):
    """Fills the leg's rows of the Jacobian; returns the foot's velocity."""
    for i in range(3):
        unit = _unit(i)
        column = cross(unit, foot)
        for k in range(3):
            J[3 * leg + k, i] = column[k]
        J[3 * leg + i, 3 + i] = 1.0
    velocity = add(base_v, cross(base_w, foot))
    for i in range(3):
        column = cross(vector(axes[i]), subtract(foot, vector(origins[i])))
        velocity = add(velocity, scale(v[6 + 3 * leg + i], column))
        for k in range(3):
            J[3 * leg + k, 6 + 3 * leg + i] = column[k]
    return velocity
