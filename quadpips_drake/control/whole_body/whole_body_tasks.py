"""Building blocks of whole-body control: weighted least-squares tasks and linear constraints on z = [vdot, f].

z stacks the generalised accelerations vdot = [dw_WB, dv_WB, joint accelerations] (18) and the ground forces on the four feet
in W (12). Every block is a plain function of the dynamics and of what is wanted; blocks are joined with ``+`` and weighted
with ``*``, so that the controller reads as a sentence.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from quadpips_drake.control.whole_body.robot_dynamics import NUM_VELOCITIES, DynamicsTerms
from quadpips_drake.math.small_algebra import vector
from quadpips_drake.trajectory.ocp.terms.friction_cone import ROWS, friction_pyramid
from quadpips_drake.values.legs import NUM_JOINTS, NUM_LEGS

NUM_FORCES = 3 * NUM_LEGS
NUM_VARIABLES = NUM_VELOCITIES + NUM_FORCES
FORCE_ROWS = ROWS + 1
"""Inequalities for the force on one foot: the faces of its friction polyhedron, and its normal part."""
ACCELERATION = slice(0, NUM_VELOCITIES)
FORCE = slice(NUM_VELOCITIES, NUM_VARIABLES)


@dataclass(frozen=True, eq=False)
class Task:
    """Wish A z = b, costing |A z - b|^2 (rows already carry the square root of their weight)."""

    matrix: np.ndarray
    """(m, 30)"""
    target: np.ndarray
    """(m,)"""
    __array_ufunc__ = None  # lets an array of weights on the left call __rmul__

    def __add__(self, other: "Task") -> "Task":
        return Task(np.concatenate((self.matrix, other.matrix)), np.concatenate((self.target, other.target)))

    def __rmul__(self, weight) -> "Task":
        """``weight`` multiplies the cost: a number, or one for each row."""
        root = np.sqrt(weight)
        return Task(self.matrix * (root[:, None] if np.ndim(root) else root), self.target * root)


@dataclass(frozen=True, eq=False)
class Level:
    """A task with its place in the order of priority and its weight, for either way of ranking."""

    name: str
    weight: float
    """Of the squared errors, where tasks are ranked by weight."""
    task: Task


@dataclass(frozen=True, eq=False)
class Limits:
    """lower <= A z <= upper."""

    matrix: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def __add__(self, other: "Limits") -> "Limits":
        return Limits(
            np.concatenate((self.matrix, other.matrix)),
            np.concatenate((self.lower, other.lower)),
            np.concatenate((self.upper, other.upper)),
        )


def floating_base_dynamics(dynamics: DynamicsTerms) -> tuple[np.ndarray, np.ndarray]:
    """The six rows of M vdot + bias = J^T f that no motor acts on, as (A, b) of A z = b."""
    matrix = np.concatenate((dynamics.mass_matrix[:6], -dynamics.foot_jacobian[:, :6].T), axis=1)
    return matrix, -dynamics.bias[:6]


def torque_map(dynamics: DynamicsTerms) -> tuple[np.ndarray, np.ndarray]:
    """(A, b) with joint torques = A z + b (the twelve rows that the motors act on)."""
    matrix = np.concatenate((dynamics.mass_matrix[6:], -dynamics.foot_jacobian[:, 6:].T), axis=1)
    return matrix, dynamics.bias[6:]


def torque_limits(torque_matrix: np.ndarray, torque_bias: np.ndarray, effort_limits: np.ndarray) -> Limits:
    """|tau| <= effort limits [N m]."""
    return Limits(torque_matrix, -effort_limits - torque_bias, effort_limits - torque_bias)


def joint_stops(positions, velocities, lower, upper, rate: float) -> Limits:
    """Joints are braked ahead of their position limits.

    A joint at distance d from its stop that moves towards it at speed v may accelerate by at most rate^2 d - 2 rate v: so it
    comes to rest at the stop like a critically damped spring, and never beyond (an exponential barrier of second order:
    Q. Nguyen, K. Sreenath, Exponential control barrier functions, ACC 2016).

    Args:
        positions, velocities: of the joints [rad, rad/s], (12,).
        lower, upper: position limits [rad], (12,).
        rate: [1/s].
    """
    damping = 2.0 * rate * velocities
    limits = joint_acceleration(np.zeros(NUM_JOINTS)).matrix
    return Limits(limits, rate**2 * (lower - positions) - damping, rate**2 * (upper - positions) - damping)


def friction_pyramids(normals: np.ndarray, contacts: np.ndarray, friction: float, max_force: float) -> Limits:
    """Polyhedron inside the friction cone of each foot about its own ground normal (see ``friction_pyramid``), and
    0 <= n.f <= max_force, which is zero for a foot in the air.

    Args:
        normals: unit normals in W, (4, 3).
        contacts: bool (4,).
        friction: coefficient mu [1].
        max_force: largest normal force of a foot [N].
    """
    matrix = np.zeros((NUM_VARIABLES, FORCE_ROWS * NUM_LEGS))
    pyramid_columns(normals, friction, 1.0, matrix)
    upper = np.full(FORCE_ROWS * NUM_LEGS, np.inf)
    upper[ROWS::FORCE_ROWS] = np.where(contacts, max_force, 0.0)
    return Limits(matrix.T, np.zeros(FORCE_ROWS * NUM_LEGS), upper)


@njit(cache=True)
def pyramid_columns(normals, friction, scale, matrix):
    """Writes the rows of ``friction_pyramids``, FORCE_ROWS for each foot, times ``scale`` into the columns of ``matrix``,
    (30, 28) or wider; only where they are not zero."""
    faces = np.empty((ROWS, 3))
    for leg in range(NUM_LEGS):
        normal = vector(normals[leg])
        friction_pyramid(normal, 0.0, friction, faces)
        for i in range(3):
            row, first = NUM_VELOCITIES + 3 * leg + i, FORCE_ROWS * leg
            for k in range(ROWS):
                matrix[row, first + k] = scale * faces[k, i]
            matrix[row, first + ROWS] = scale * normal[i]


def foot_acceleration(dynamics: DynamicsTerms, accelerations: np.ndarray, feet: np.ndarray) -> Task:
    """The chosen ``feet``, bool (4,), accelerate as given, (4, 3) [m/s^2]: J vdot = a - Jdot v."""
    rows = np.repeat(feet, 3)
    matrix = np.zeros((3 * int(feet.sum()), NUM_VARIABLES))
    matrix[:, ACCELERATION] = dynamics.foot_jacobian[rows]
    return Task(matrix, accelerations.ravel()[rows] - dynamics.foot_bias[rows])


def base_acceleration(acceleration: np.ndarray) -> Task:
    """The base accelerates as given: [angular [rad/s^2], linear [m/s^2]] in W, (6,)."""
    matrix = np.zeros((6, NUM_VARIABLES))
    matrix[:, :6] = np.eye(6)
    return Task(matrix, acceleration)


def joint_acceleration(acceleration: np.ndarray) -> Task:
    """The joints accelerate as given [rad/s^2], (12,)."""
    matrix = np.zeros((NUM_JOINTS, NUM_VARIABLES))
    matrix[:, 6:NUM_VELOCITIES] = np.eye(NUM_JOINTS)
    return Task(matrix, acceleration)


def contact_forces(forces: np.ndarray) -> Task:
    """The ground forces are as given in W [N], (4, 3)."""
    matrix = np.zeros((NUM_FORCES, NUM_VARIABLES))
    matrix[:, FORCE] = np.eye(NUM_FORCES)
    return Task(matrix, forces.ravel())
