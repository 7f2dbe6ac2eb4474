"""Centroidal dynamics and foot kinematics of a 12-joint quadruped with all first derivatives, in numba.

Everything that depends on the joints alone is computed in the base frame B, where base pose and momentum enter only through
rotations. Notation: c centre of mass, I inertia of the frozen robot about c, K angular momentum about c per joint rate, m
mass; a_j, o_j axis and origin of joint j; r_b, V_b centre of mass and velocity of link b.

    w_B = I^-1 (R^T k - K v_j),      v_WB = v_com - R (w_B x c + dc/dq v_j)
"""

import numpy as np
from numba import njit

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.rotations import roll_pitch_yaw_rates, rotation_from_rpy
from quadpips_drake.math.small_algebra import (
    accumulate,
    add,
    cross,
    inverse_3x3,
    scale,
    store,
    store_matrix,
    subtract,
    times,
    transpose_times,
    vector,
)
from quadpips_drake.robots.kinematic_tree import axis_rotation
from quadpips_drake.values.centroidal import STATE_SIZE, CentroidalInput, CentroidalState

# Where the parts of the state and of the input begin: compiled loops count from there.
MOMENTUM, ANGULAR = CentroidalState.MOMENTUM.start, CentroidalState.ANGULAR.start
POSITION, ANGLES, JOINTS = (
    CentroidalState.POSITION.start,
    CentroidalState.ORIENTATION.start,
    CentroidalState.JOINTS.start,
)
JOINT_RATES = CentroidalInput.JOINT_VELOCITIES.start


@njit(cache=True)
def link_kinematics(tree, q):
    """Returns, in B: joint axes (12, 3), joint origins (12, 3), link centres of mass (13, 3), link inertias about them
    (13, 3, 3), feet (4, 3)."""
    axes, origins = np.empty((12, 3)), np.empty((12, 3))
    coms, inertias, feet = np.empty((13, 3)), np.empty((13, 3, 3)), np.empty((4, 3))
    store(coms[0], tree.link_com[0])
    store_matrix(inertias[0], tree.link_inertia[0])
    rotation, product = np.empty((3, 3)), np.empty((3, 3))
    for j in range(12):
        turn = axis_rotation(tree.joint_axis[j], q[j])
        if j % 3 == 0:
            origin = vector(tree.joint_offset[j])
            store_matrix(rotation, turn)
        else:
            origin = add(vector(origins[j - 1]), times(rotation, tree.joint_offset[j]))
            for row in range(3):
                store(product[row], transpose_times(turn, rotation[row]))
            store_matrix(rotation, product)
        store(origins[j], origin)
        store(axes[j], times(rotation, tree.joint_axis[j]))
        store(coms[j + 1], add(origin, times(rotation, tree.link_com[j + 1])))
        for row in range(3):  # rotation I rotation^T, using that I is symmetric
            store(product[row], times(tree.link_inertia[j + 1], rotation[row]))
        for row in range(3):
            store(inertias[j + 1, row], times(product, rotation[row]))
        if j % 3 == 2:
            store(feet[j // 3], add(origin, times(rotation, tree.foot_offset[j // 3])))
    return axes, origins, coms, inertias, feet


@njit(cache=True)
def composite_terms(tree, axes, origins, coms, inertias):
    """Returns m, c (3,), dc/dq (3, 12), I (3, 3), K (3, 12), all in B."""
    mass = tree.link_mass.sum()
    center, inertia = np.zeros(3), np.zeros((3, 3))
    for b in range(13):
        accumulate(center, scale(tree.link_mass[b] / mass, coms[b]))
    center_jacobian, momentum_jacobian = np.zeros((3, 12)), np.zeros((3, 12))
    for b in range(13):
        m, arm = tree.link_mass[b], subtract(coms[b], center)
        squared = arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2]
        for i in range(3):
            for k in range(3):
                inertia[i, k] += inertias[b, i, k] - m * arm[i] * arm[k]
            inertia[i, i] += m * squared
        if b == 0:
            continue
        for j in range((b - 1) // 3 * 3, b):
            velocity = cross(axes[j], subtract(coms[b], origins[j]))
            momentum = add(times(inertias[b], axes[j]), scale(m, cross(arm, velocity)))
            for i in range(3):
                center_jacobian[i, j] += m / mass * velocity[i]
                momentum_jacobian[i, j] += momentum[i]
    return mass, center, center_jacobian, inertia, momentum_jacobian


@njit(cache=True, inline="always")
def _point_acceleration(axes, origins, rates, first, last, i, point):
    """Motion of ``point`` on link ``last`` by q_i, and derivative by q_i of the velocity that joints first..last give it."""
    moved = cross(axes[i], subtract(point, origins[i]))
    total = (0.0, 0.0, 0.0)
    for j in range(first, last + 1):
        if j <= i:
            total = add(total, scale(rates[j], cross(axes[j], moved)))
        else:
            total = add(total, scale(rates[j], cross(axes[i], cross(axes[j], subtract(point, origins[j])))))
    return moved, total


@njit(cache=True)
def momentum_derivatives(tree, axes, origins, coms, inertias, mass, center, center_jacobian, w, rates):
    """Returns d(dc/dq v_j)/dq (3, 12) and d(I w + K v_j)/dq (3, 12) at fixed w = ``w`` and v_j = ``rates``."""
    center_rate, momentum = np.zeros((3, 12)), np.zeros((3, 12))
    total = (0.0, 0.0, 0.0)
    for j in range(12):
        total = add(total, scale(rates[j], vector(center_jacobian[:, j])))
    total = scale(mass, add(total, cross(w, center)))
    for b in range(1, 13):
        first, last, m = (b - 1) // 3 * 3, b - 1, tree.link_mass[b]
        spin, velocity = vector(w), cross(w, coms[b])
        for j in range(first, last + 1):
            spin = add(spin, scale(rates[j], axes[j]))
            velocity = add(velocity, scale(rates[j], cross(axes[j], subtract(coms[b], origins[j]))))
        angular, arm = times(inertias[b], spin), subtract(coms[b], center)
        for i in range(first, last + 1):
            moved, relative = _point_acceleration(axes, origins, rates, first, last, i, coms[b])
            spin_change = (0.0, 0.0, 0.0)
            for j in range(i + 1, last + 1):
                spin_change = add(spin_change, scale(rates[j], cross(axes[i], axes[j])))
            change = subtract(cross(axes[i], angular), times(inertias[b], cross(axes[i], spin)))
            change = add(change, times(inertias[b], spin_change))
            change = add(change, scale(m, cross(moved, velocity)))
            change = add(change, scale(m, cross(arm, add(cross(w, moved), relative))))
            for k in range(3):
                center_rate[k, i] += m / mass * relative[k]
                momentum[k, i] += change[k]
    for i in range(12):
        change = cross(center_jacobian[:, i], total)
        for k in range(3):
            momentum[k, i] -= change[k]
    return center_rate, momentum


@njit(cache=True)
def knot_motion(tree, x, u, f, p, v):
    """Writes dx/dt = f(x, u), (24,), and positions and velocities of the feet in W, (4, 3).

    Returns the rotation of the base, its angular velocity in B, and what ``link_kinematics`` gives.
    """
    rotation = rotation_from_rpy(x[ANGLES:JOINTS])
    rates, _ = roll_pitch_yaw_rates(x[ANGLES:JOINTS])
    kinematics = link_kinematics(tree, x[JOINTS:])
    axes, origins, coms, inertias, feet = kinematics
    mass, center, center_jacobian, inertia, joint_momentum = composite_terms(tree, axes, origins, coms, inertias)
    momentum, slip = scale(mass, transpose_times(rotation, x[ANGULAR:POSITION])), (0.0, 0.0, 0.0)
    for j in range(12):
        momentum = subtract(momentum, scale(u[JOINT_RATES + j], vector(joint_momentum[:, j])))
        slip = add(slip, scale(u[JOINT_RATES + j], vector(center_jacobian[:, j])))
        f[JOINTS + j] = u[JOINT_RATES + j]
    w = times(inverse_3x3(inertia), momentum)
    slip = add(slip, cross(w, center))
    store(f[POSITION:], subtract(x[MOMENTUM:ANGULAR], times(rotation, slip)))
    store(f[ANGLES:], times(rates, w))
    force, torque = (0.0, 0.0, -mass * GRAVITY), (0.0, 0.0, 0.0)
    for leg in range(4):
        foot = vector(feet[leg])
        relative = cross(w, foot)
        for j in range(3 * leg, 3 * leg + 3):
            relative = add(relative, scale(u[JOINT_RATES + j], cross(axes[j], subtract(foot, origins[j]))))
        store(p[leg], add(vector(x[POSITION:]), times(rotation, foot)))
        store(v[leg], add(vector(f[POSITION:]), times(rotation, relative)))
        push = vector(u[3 * leg :])
        force = add(force, push)
        torque = add(torque, cross(times(rotation, subtract(foot, center)), push))
    store(f[MOMENTUM:], scale(1.0 / mass, force))
    store(f[ANGULAR:], scale(1.0 / mass, torque))
    return rotation, w, kinematics


@njit(cache=True, nogil=True)
def motion_kernel(tree, x, u):
    """Returns dx/dt = f(x, u), (24,), and the angular velocity of the base in W, (3,)."""
    f, p, v, twist = np.empty(STATE_SIZE), np.empty((4, 3)), np.empty((4, 3)), np.empty(3)
    rotation, w, _ = knot_motion(tree, x, u, f, p, v)
    store(twist, times(rotation, w))
    return f, twist
