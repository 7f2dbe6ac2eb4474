"""What whole-body control aims at: base acceleration, forces, joint set points; small formulas, compiled where it counts."""

import numpy as np
from numba import njit

from quadpips_drake.control.whole_body.contact_logic import FootTargets
from quadpips_drake.control.whole_body.robot_dynamics import JOINTS, ROTATION, VELOCITY, DynamicsTerms, measured
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.math.small_algebra import inverse_3x3
from quadpips_drake.values.legs import NUM_LEGS
from quadpips_drake.values.mpc_policy import PolicySample
from quadpips_drake.values.robot_state import RobotState

_MAX_JOINT_STEP = 0.3
"""Largest distance of joint set points from the measured joints [rad]."""


@njit(cache=True)
def rotation_error(rpy_desired, R_WB):
    """Small rotation in W that turns ``R_WB`` into the desired attitude [rad], (3,)."""
    desired = rotation_from_rpy(rpy_desired)
    R = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            R[i, j] = desired[i, 0] * R_WB[j, 0] + desired[i, 1] * R_WB[j, 1] + desired[i, 2] * R_WB[j, 2]
    # Twice the vector part of the quaternion: exact to third order, and finite for any error.
    factor = 1.0 / np.sqrt(max(1.0 + R[0, 0] + R[1, 1] + R[2, 2], 1e-2))
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) * factor


def base_acceleration(state: RobotState, sample: PolicySample, dynamics: DynamicsTerms, config) -> np.ndarray:
    """[angular, linear] in W, (6,): what the policy's forces do to the robot with locked joints, plus PD about its pose."""
    wanted = np.empty(6)
    terms = dynamics.mass_matrix, dynamics.bias, dynamics.foot_jacobian
    twist = np.concatenate((sample.w_WB, sample.v_WB))
    forces = np.array(sample.forces)
    aim_base(base_gains(config), *terms, measured(state), sample.p_WB, sample.rpy_WB, twist, forces, wanted)
    return wanted


def base_gains(config) -> tuple[float, float, float, float]:
    """Of ``aim_base``: linear kp and kd, angular kp and kd."""
    c = config
    return float(c.base_linear_kp), float(c.base_linear_kd), float(c.base_angular_kp), float(c.base_angular_kd)


@njit(cache=True)
def aim_base(gains, mass_matrix, bias, jacobian, state, p_d, rpy_d, twist_d, forces, wanted):
    """Fills ``wanted`` (6,); see ``base_acceleration``. ``state`` is as ``measured`` puts it; ``forces`` (4, 3)."""
    _locked_acceleration(mass_matrix, bias, jacobian, forces, wanted)
    twist = state[VELOCITY]
    error = rotation_error(rpy_d, state[ROTATION].reshape((3, 3)))
    for i in range(3):
        wanted[i] += gains[2] * error[i] + gains[3] * (twist_d[i] - twist[i])
        wanted[3 + i] += gains[0] * (p_d[i] - state[i]) + gains[1] * (twist_d[3 + i] - twist[3 + i])


@njit(cache=True)
def _locked_acceleration(mass_matrix, bias, jacobian, forces, wrench):
    """Fills ``wrench`` (6,) with the acceleration of the robot with locked joints under the feet's ``forces`` (4, 3):
    [angular, linear]."""
    matrix = np.empty((6, 6))
    for i in range(6):
        wrench[i] = -bias[i]
        for leg in range(NUM_LEGS):
            for k in range(3):
                wrench[i] += jacobian[3 * leg + k, i] * forces[leg, k]
        for j in range(6):
            matrix[i, j] = mass_matrix[i, j]
    # Symmetric and positive definite: elimination without pivots.
    for i in range(6):
        for row in range(i + 1, 6):
            factor = matrix[row, i] / matrix[i, i]
            wrench[row] -= factor * wrench[i]
            for j in range(i, 6):
                matrix[row, j] -= factor * matrix[i, j]
    for i in range(5, -1, -1):
        for j in range(i + 1, 6):
            wrench[i] -= matrix[i, j] * wrench[j]
        wrench[i] /= matrix[i, i]


def joint_targets(
    state: RobotState, sample: PolicySample, targets: FootTargets, dynamics: DynamicsTerms
) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions [rad] and velocities [rad/s] that put the feet where they should be, (12,) each.

    The joints' own PD control then pulls in the direction of the swing and damps about the planned motion: positions are one
    Newton step of inverse kinematics away from the measured ones (on the ground: none), velocities those of the wanted feet
    under a base that moves as planned.
    """
    positions, velocities = np.empty(12), np.empty(12)
    twist = np.concatenate((sample.w_WB, sample.v_WB))
    aim_joints(
        dynamics.foot_jacobian, measured(state), twist, dynamics.p_WF, targets.positions, targets.velocities, positions,
        velocities,
    )  # fmt: skip
    return positions, velocities


@njit(cache=True)
def aim_joints(jacobian, state, twist, p_WF, p_d, v_d, positions, velocities):
    """Fills joint positions and velocities (12,); see ``joint_targets``. ``twist`` is that of the planned base."""
    joints = state[JOINTS]
    for leg in range(NUM_LEGS):
        first = 3 * leg
        normal, by_offset, by_velocity = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
        for k in range(3):
            row = jacobian[first + k]
            velocity = v_d[leg, k]
            for i in range(6):
                velocity -= row[i] * twist[i]
            for i in range(3):
                by_offset[i] += row[6 + first + i] * (p_d[leg, k] - p_WF[leg, k])
                by_velocity[i] += row[6 + first + i] * velocity
                for j in range(3):
                    normal[i, j] += row[6 + first + i] * row[6 + first + j]
        for i in range(3):
            normal[i, i] += 1e-4  # damped least squares: finite where a leg is stretched out
        inverse = inverse_3x3(normal)
        for i in range(3):
            step = inverse[i, 0] * by_offset[0] + inverse[i, 1] * by_offset[1] + inverse[i, 2] * by_offset[2]
            positions[first + i] = joints[first + i] + min(max(step, -_MAX_JOINT_STEP), _MAX_JOINT_STEP)
            velocities[first + i] = (
                inverse[i, 0] * by_velocity[0] + inverse[i, 1] * by_velocity[1] + inverse[i, 2] * by_velocity[2]
            )


def redistributed(forces: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """The policy's forces (4, 3) [N] when only ``contacts`` bear: what the others should carry is shared among them."""
    wanted = np.empty((NUM_LEGS, 3))
    redistribute(np.array(forces), contacts, wanted)
    return wanted


@njit(cache=True)
def redistribute(forces, contacts, wanted):
    """Fills ``wanted`` (4, 3); see ``redistributed``."""
    bearing = 0
    for leg in range(NUM_LEGS):
        bearing += 1 if contacts[leg] else 0
    for i in range(3):
        missing = 0.0
        for leg in range(NUM_LEGS):
            missing += 0.0 if contacts[leg] else forces[leg, i]
        for leg in range(NUM_LEGS):
            if bearing == 0:
                wanted[leg, i] = forces[leg, i]
            else:
                wanted[leg, i] = forces[leg, i] + missing / bearing if contacts[leg] else 0.0
