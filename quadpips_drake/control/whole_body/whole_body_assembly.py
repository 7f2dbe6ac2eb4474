"""The weighted program of whole-body control assembled by one compiled function, without the zeros.

``WeightedMethod.solve`` does the same with tasks; the difference is 0.1 ms a tick. The program is assembled here only where
both say the same (``WeightedAssembly.stands_for``), so that a task that is added to it is never lost.
"""

import numpy as np
from numba import njit

from quadpips_drake.control.whole_body.contact_logic import FootTargets
from quadpips_drake.control.whole_body.robot_dynamics import NUM_VELOCITIES, DynamicsTerms
from quadpips_drake.control.whole_body.whole_body_methods import WholeBodyProgram
from quadpips_drake.control.whole_body.whole_body_tasks import NUM_VARIABLES, pyramid_rows
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.values.legs import NUM_JOINTS, NUM_LEGS

_TOLERANCE = 1e-9
"""Rounding by which two assemblies of one program may differ, as part of the largest entry [1]."""


class WeightedAssembly:
    """From dynamics and wishes to H, g, A, b, C, lower, upper of the weighted program in scaled variables."""

    LEVELS = ("contact", "swing", "base", "forces")
    """Names of the levels that are assembled."""

    def __init__(self, robot, config):
        self._mass = robot.mass
        self._efforts = np.array(robot.effort_limits, dtype=float)
        self._friction, self._max_force = config.friction, config.max_force_ratio * robot.mass * GRAVITY
        self._weights = np.array(
            [config.stance_weight, config.swing_weight, config.base_weight, config.force_weight, config.joint_weight]
        )

    def matrices(
        self, dynamics: DynamicsTerms, targets: FootTargets, base: np.ndarray, forces: np.ndarray, normals
    ) -> tuple:
        """H, g, A, b, C, lower, upper.

        Args:
            dynamics, targets: as in TaskSpaceInverseDynamics.
            base: wanted acceleration of the base [angular, linear], (6,).
            forces: wanted forces in W [N], (4, 3).
            normals: unit normals of the ground under the feet, (4, 3).
        """
        contacts = targets.contacts
        terms = dynamics.mass_matrix, dynamics.bias, dynamics.foot_jacobian
        H, g = _cost(
            dynamics.foot_jacobian,
            dynamics.foot_bias,
            targets.accelerations,
            contacts,
            base,
            forces / self._mass,
            self._weights,
        )
        return H, g, *_constraints(*terms, normals, contacts, self._efforts, self._friction, self._max_force, self._mass)

    def stands_for(self, program: WholeBodyProgram, matrices: tuple, assembled: tuple) -> bool:
        """Whether this is another way to say ``program``.

        Args:
            program: an example with feet on the ground and in the air, so that every level has rows.
            matrices: H, g, A, b, C, lower, upper that its tasks lead to.
            assembled: the same from ``matrices`` of this class.
        """
        if tuple(level.name for level in program.levels) != self.LEVELS or program.stops is not None:
            return False
        return all(_agree(ours, theirs) for ours, theirs in zip(assembled, matrices, strict=True))


def _agree(ours: np.ndarray, theirs: np.ndarray) -> bool:
    if ours.shape != theirs.shape:
        return False
    size = np.abs(theirs[np.isfinite(theirs)]).max(initial=0.0)
    return np.allclose(ours, theirs, rtol=0.0, atol=_TOLERANCE * size)


@njit(cache=True)
def _cost(jacobian, foot_bias, accelerations, contacts, base, forces, weights):
    H, g = np.zeros((NUM_VARIABLES, NUM_VARIABLES)), np.zeros(NUM_VARIABLES)
    columns = np.arange(9)  # a foot is moved by the base and by its own leg's joints
    for leg in range(NUM_LEGS):
        weight = weights[0] if contacts[leg] else weights[1]
        for k in range(3):
            columns[6 + k] = 6 + 3 * leg + k
        for k in range(3):
            row = jacobian[3 * leg + k]
            target = accelerations[leg, k] - foot_bias[3 * leg + k]
            for i in columns:
                g[i] -= weight * row[i] * target
                for j in columns:
                    H[i, j] += weight * row[i] * row[j]
            index = NUM_VELOCITIES + 3 * leg + k
            H[index, index] += weights[3]
            g[index] -= weights[3] * forces[leg, k]
    for i in range(6):
        H[i, i] += weights[2]
        g[i] -= weights[2] * base[i]
    for i in range(6, NUM_VELOCITIES):
        H[i, i] += weights[4]
    return H, g


@njit(cache=True)
def _constraints(mass_matrix, bias, jacobian, normals, contacts, efforts, friction, max_force, mass):
    A, b = np.zeros((6, NUM_VARIABLES)), -bias[:6]
    friction_rows = 5 * NUM_LEGS
    C = np.zeros((friction_rows + NUM_JOINTS, NUM_VARIABLES))
    lower, upper = np.zeros(len(C)), np.full(len(C), np.inf)
    C[:friction_rows] = mass * pyramid_rows(normals, friction)
    for leg in range(NUM_LEGS):
        upper[5 * leg + 4] = max_force if contacts[leg] else 0.0
    for i in range(NUM_VELOCITIES):
        for j in range(6):
            A[j, i] = mass_matrix[j, i]
        for j in range(NUM_JOINTS):
            C[friction_rows + j, i] = mass_matrix[6 + j, i]
    for i in range(3 * NUM_LEGS):
        for j in range(6):
            A[j, NUM_VELOCITIES + i] = -mass * jacobian[i, j]
        for j in range(NUM_JOINTS):
            C[friction_rows + j, NUM_VELOCITIES + i] = -mass * jacobian[i, 6 + j]
    for j in range(NUM_JOINTS):
        lower[friction_rows + j] = -efforts[j] - bias[6 + j]
        upper[friction_rows + j] = efforts[j] - bias[6 + j]
    return A, b, C, lower, upper
