"""First derivatives of the centroidal dynamics and of the feet: one call per knot, all terms shared."""

import numpy as np
from numba import njit

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.rotations import roll_pitch_yaw_rates, rotation_derivatives
from quadpips_drake.math.small_algebra import (
    add,
    cross,
    dot,
    inverse_3x3,
    scale,
    store,
    store_matrix,
    subtract,
    times,
    transpose_times,
    vector,
)
from quadpips_drake.trajectory.centroidal.centroidal_kernels import (
    ANGLES,
    ANGULAR,
    JOINT_RATES,
    JOINTS,
    MOMENTUM,
    POSITION,
    composite_terms,
    link_kinematics,
    momentum_derivatives,
)
from quadpips_drake.values.centroidal import STATE_SIZE


@njit(cache=True)
def base_twist_derivatives(tree, x, u, kinematics, rotation, rotation_angles):
    """Returns the base twist in B and its derivatives.

    w (3,) angular velocity, s (3,) velocity of the centre of mass relative to the base origin, both in B; w_x, s_x (3, 24)
    by the state, w_u, s_u (3, 12) by the joint rates; then mass, c (3,), dc/dq (3, 12).
    """
    axes, origins, coms, inertias, _ = kinematics
    mass, center, center_jacobian, inertia, joint_momentum = composite_terms(tree, axes, origins, coms, inertias)
    inverse = inverse_3x3(inertia)
    k = scale(mass, vector(x[ANGULAR:]))
    momentum, center_rate = transpose_times(rotation, k), (0.0, 0.0, 0.0)
    for j in range(12):
        rate = u[JOINT_RATES + j]
        momentum = subtract(momentum, scale(rate, vector(joint_momentum[:, j])))
        center_rate = add(center_rate, scale(rate, vector(center_jacobian[:, j])))
    w = times(inverse, momentum)
    s = add(cross(w, center), center_rate)
    center_rate_q, momentum_q = momentum_derivatives(
        tree, axes, origins, coms, inertias, mass, center, center_jacobian, w, u[JOINT_RATES:]
    )
    w_x, s_x = np.zeros((3, STATE_SIZE)), np.zeros((3, STATE_SIZE))
    w_u, s_u = np.empty((3, 12)), np.empty((3, 12))
    for i in range(3):
        turned = times(inverse, transpose_times(rotation_angles[i], k))
        for j in range(3):
            w_x[j, ANGLES + i] = turned[j]
            w_x[j, ANGULAR + i] = mass * dot(inverse[j], rotation[i])
    for i in range(ANGULAR, JOINTS):
        if i < POSITION or i >= ANGLES:
            lever = cross(w_x[:, i], center)
            for j in range(3):
                s_x[j, i] = lever[j]
    for i in range(12):
        moved, by_rate = vector(center_jacobian[:, i]), scale(-1.0, times(inverse, joint_momentum[:, i]))
        by_angle = scale(-1.0, times(inverse, momentum_q[:, i]))
        lever = add(add(cross(by_angle, center), cross(w, moved)), vector(center_rate_q[:, i]))
        lever_rate = add(cross(by_rate, center), moved)
        for j in range(3):
            w_x[j, JOINTS + i], s_x[j, JOINTS + i] = by_angle[j], lever[j]
            w_u[j, i], s_u[j, i] = by_rate[j], lever_rate[j]
    return w, s, w_x, s_x, w_u, s_u, mass, center, center_jacobian


@njit(cache=True)
def _force_rows(f, a, b, u, mass, rotation, rotation_angles, center, center_jacobian, feet, axes, origins):
    """Rows of both momenta: forces and their levers about the centre of mass."""
    f[MOMENTUM:POSITION] = 0.0
    f[MOMENTUM + 2] = -GRAVITY
    for leg in range(4):
        force = vector(u[3 * leg :])
        arm_b = subtract(feet[leg], center)
        arm = times(rotation, arm_b)
        torque = cross(arm, force)
        for i in range(3):
            f[i] += force[i] / mass
            f[ANGULAR + i] += torque[i] / mass
            b[i, 3 * leg + i] = 1.0 / mass
            turned = cross(times(rotation_angles[i], arm_b), force)
            for j in range(3):
                a[ANGULAR + j, ANGLES + i] += turned[j] / mass
        b[3, 3 * leg + 1], b[3, 3 * leg + 2] = -arm[2] / mass, arm[1] / mass
        b[4, 3 * leg], b[4, 3 * leg + 2] = arm[2] / mass, -arm[0] / mass
        b[5, 3 * leg], b[5, 3 * leg + 1] = -arm[1] / mass, arm[0] / mass
        force_b = transpose_times(rotation, force)
        for j in range(12):
            change = scale(-1.0, vector(center_jacobian[:, j]))
            if j // 3 == leg:
                change = add(change, cross(axes[j], subtract(feet[leg], origins[j])))
            torque = times(rotation, cross(change, force_b))
            for i in range(3):
                a[ANGULAR + i, JOINTS + j] += torque[i] / mass


@njit(cache=True)
def _pose_rows(f, a, b, x, u, rotation, rotation_angles, twist):
    """Rows of base position, roll-pitch-yaw and joints; also v_WB_x (3, 24), those of the position."""
    w, s, w_x, s_x, w_u, s_u = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    rate, rate_angles = roll_pitch_yaw_rates(x[ANGLES:JOINTS])
    velocity = subtract(x[MOMENTUM:ANGULAR], times(rotation, s))
    turning = times(rate, w)
    for i in range(3):
        f[POSITION + i], f[ANGLES + i] = velocity[i], turning[i]
        for j in range(STATE_SIZE):
            a[POSITION + i, j] = -(rotation[i, 0] * s_x[0, j] + rotation[i, 1] * s_x[1, j] + rotation[i, 2] * s_x[2, j])
            a[ANGLES + i, j] = rate[i, 0] * w_x[0, j] + rate[i, 1] * w_x[1, j] + rate[i, 2] * w_x[2, j]
        a[POSITION + i, i] += 1.0
        for j in range(12):
            column = JOINT_RATES + j
            b[POSITION + i, column] = -(rotation[i, 0] * s_u[0, j] + rotation[i, 1] * s_u[1, j] + rotation[i, 2] * s_u[2, j])
            b[ANGLES + i, column] = rate[i, 0] * w_u[0, j] + rate[i, 1] * w_u[1, j] + rate[i, 2] * w_u[2, j]
    for i in range(3):
        turned = times(rotation_angles[i], s)
        for j in range(3):
            a[POSITION + j, ANGLES + i] -= turned[j]
        if i < 2:
            turned = times(rate_angles[i], w)
            for j in range(3):
                a[ANGLES + j, ANGLES + i] += turned[j]
    for j in range(12):
        f[JOINTS + j] = u[JOINT_RATES + j]
        b[JOINTS + j, JOINT_RATES + j] = 1.0


@njit(cache=True)
def _foot_rows(leg, u, rotation, rotation_angles, twist, kinematics, f, a, b, p, v, p_x, v_x, v_u):
    """Position and velocity of one foot relative to the base's, in W, and their derivatives (position of base left out)."""
    w, _, w_x, _, w_u = twist[0], twist[1], twist[2], twist[3], twist[4]
    axes, origins, _, _, feet = kinematics
    foot, first = feet[leg], 3 * leg
    relative = cross(w, foot)
    for j in range(first, first + 3):
        relative = add(relative, scale(u[JOINT_RATES + j], cross(axes[j], subtract(foot, origins[j]))))
    store(p, times(rotation, foot))
    store(v, add(vector(f[POSITION:]), times(rotation, relative)))
    store_matrix(v_x, a[POSITION:ANGLES, :])
    store_matrix(v_u, b[POSITION:ANGLES, :])
    p_x[:, :] = 0.0
    for i in range(3):
        p_x[i, POSITION + i] = 1.0
        turned, turning = times(rotation_angles[i], foot), times(rotation_angles[i], relative)
        for k in range(3):
            p_x[k, ANGLES + i] = turned[k]
            v_x[k, ANGLES + i] += turning[k]
    for j in range(ANGULAR, STATE_SIZE):
        change = times(rotation, cross(w_x[:, j], foot))
        for k in range(3):
            v_x[k, j] += change[k]
    for j in range(12):
        change = times(rotation, cross(w_u[:, j], foot))
        for k in range(3):
            v_u[k, JOINT_RATES + j] += change[k]
    for i in range(first, first + 3):
        moved = cross(axes[i], subtract(foot, origins[i]))
        change = cross(w, moved)
        for j in range(first, first + 3):
            if j <= i:
                bent = cross(axes[j], moved)
            else:
                bent = cross(axes[i], cross(axes[j], subtract(foot, origins[j])))
            change = add(change, scale(u[JOINT_RATES + j], bent))
        moved_w, change_w = times(rotation, moved), times(rotation, change)
        for k in range(3):
            p_x[k, JOINTS + i] = moved_w[k]
            v_x[k, JOINTS + i] += change_w[k]
            v_u[k, JOINT_RATES + i] += moved_w[k]


@njit(cache=True)
def dynamics_derivatives(tree, x, u, f, a, b):
    """Writes f(x, u) (24,), A = df/dx (24, 24), B = df/du (24, 24)."""
    a[:, :] = 0.0
    b[:, :] = 0.0
    rotation, rotation_angles = rotation_derivatives(x[ANGLES:JOINTS])
    kinematics = link_kinematics(tree, x[JOINTS:])
    twist = base_twist_derivatives(tree, x, u, kinematics, rotation, rotation_angles)
    mass, center, center_jacobian = twist[6], twist[7], twist[8]
    _force_rows(
        f, a, b, u, mass, rotation, rotation_angles, center, center_jacobian, kinematics[4], kinematics[0], kinematics[1]
    )
    _pose_rows(f, a, b, x, u, rotation, rotation_angles, twist)
    return rotation, rotation_angles, kinematics, twist


@njit(cache=True)
def knot_derivatives(tree, x, u, f, a, b, p, v, p_x, v_x, v_u):
    """As ``dynamics_derivatives``; also foot positions p and velocities v (4, 3) in W with p_x, v_x, v_u (4, 3, 24)."""
    rotation, rotation_angles, kinematics, twist = dynamics_derivatives(tree, x, u, f, a, b)
    for leg in range(4):
        _foot_rows(
            leg, u, rotation, rotation_angles, twist, kinematics, f, a, b, p[leg], v[leg], p_x[leg], v_x[leg], v_u[leg]
        )
        for i in range(3):
            p[leg, i] += x[POSITION + i]
    return rotation, rotation_angles, kinematics
