"""The weighted program of whole-body control assembled by one compiled function, without the zeros.

``WeightedMethod.solve`` does the same with tasks; the difference is 0.1 ms a tick. The program is assembled here only where
both say the same (``stands_for``), so that a task that is added to it is never lost.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.control.whole_body.contact_logic import FootTargets, bears
from quadpips_drake.control.whole_body.robot_dynamics import NUM_VELOCITIES, DynamicsTerms
from quadpips_drake.control.whole_body.whole_body_methods import WholeBodyProgram
from quadpips_drake.control.whole_body.whole_body_tasks import FORCE_ROWS, NUM_VARIABLES, pyramid_columns
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.values.legs import NUM_JOINTS, NUM_LEGS

LEVELS = ("contact", "swing", "base", "forces")
"""Names of the levels that are assembled."""
NUM_LIMITS = FORCE_ROWS * NUM_LEGS + NUM_JOINTS
_TOLERANCE = 1e-9
"""Rounding by which two assemblies of one program may differ, as part of the largest entry [1]."""


class AssemblySettings(NamedTuple):
    """What does not change from tick to tick."""

    mass: float
    efforts: np.ndarray
    """[N m], (12,)"""
    friction: float
    max_force: float
    """Of one foot [N]."""
    stance_weight: float
    swing_weight: float
    base_weight: float
    force_weight: float
    joint_weight: float

    @staticmethod
    def of(robot, config) -> "AssemblySettings":
        """Those of a RobotModel and a WbcConfig."""
        weights = (getattr(config, name) for name in AssemblySettings._fields[4:])
        force = float(config.max_force_ratio * robot.mass * GRAVITY)
        efforts = np.array(robot.effort_limits, dtype=float)
        return AssemblySettings(float(robot.mass), efforts, float(config.friction), force, *map(float, weights))


class ProgramData(NamedTuple):
    """min 1/2 y'Hy + g'y such that A y = b, lower <= C y <= upper, in scaled variables."""

    hessian: np.ndarray
    """H (30, 30)"""
    gradient: np.ndarray
    """g (30,)"""
    equalities: np.ndarray
    """A' (30, 6): transposed, as solvers that go column by column want it."""
    targets: np.ndarray
    """b (6,)"""
    limits: np.ndarray
    """C (40, 30)"""
    lower: np.ndarray
    """(40,)"""
    upper: np.ndarray
    """(40,)"""

    @staticmethod
    def allocated() -> "ProgramData":
        """Room for one program."""
        n = NUM_VARIABLES
        return ProgramData(*(np.zeros(s) for s in ((n, n), n, (n, 6), 6, (n, NUM_LIMITS), NUM_LIMITS, NUM_LIMITS)))

    def matrices(self) -> tuple:
        """H, g, A, b, C, lower, upper, matrices column by column; nothing is copied."""
        return self.hessian.T, self.gradient, self.equalities.T, self.targets, self.limits.T, self.lower, self.upper


def assembled_matrices(
    settings: AssemblySettings, dynamics: DynamicsTerms, targets: FootTargets, base: np.ndarray, forces: np.ndarray, normals
) -> tuple:
    """H, g, A, b, C, lower, upper.

    Args:
        settings: AssemblySettings.
        dynamics, targets: as in TaskSpaceInverseDynamics.
        base: wanted acceleration of the base [angular, linear], (6,).
        forces: wanted forces in W [N], (4, 3).
        normals: unit normals of the ground under the feet, (4, 3).
    """
    d, data = dynamics, ProgramData.allocated()
    terms = d.mass_matrix, d.bias, d.foot_jacobian, d.foot_bias
    assemble(settings, *terms, targets.accelerations, targets.modes, base, forces, normals, data)
    return data.matrices()


def stands_for(program: WholeBodyProgram, matrices: tuple, assembled: tuple) -> bool:
    """Whether ``assembled`` is another way to say ``program``.

    Args:
        program: an example with feet on the ground and in the air, so that every level has rows.
        matrices: H, g, A, b, C, lower, upper that its tasks lead to.
        assembled: the same from ``assembled_matrices``.
    """
    if tuple(level.name for level in program.levels) != LEVELS or program.stops is not None:
        return False
    return all(_agree(ours, theirs) for ours, theirs in zip(assembled, matrices, strict=True))


def _agree(ours: np.ndarray, theirs: np.ndarray) -> bool:
    if ours.shape != theirs.shape:
        return False
    size = np.abs(theirs[np.isfinite(theirs)]).max(initial=0.0)
    return np.allclose(ours, theirs, rtol=0.0, atol=_TOLERANCE * size)


@njit(cache=True)
def assemble(settings, mass_matrix, bias, jacobian, foot_bias, accelerations, modes, base, forces, normals, data):
    """Fills ``data`` (ProgramData); see ``assembled_matrices``. ``modes`` are FootModes (4,)."""
    H, g = data.hessian, data.gradient
    H[:], g[:] = 0.0, 0.0
    columns = np.arange(9)  # a foot is moved by the base and by its own leg's joints
    for leg in range(NUM_LEGS):
        weight = settings.stance_weight if bears(modes[leg]) else settings.swing_weight
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
            H[index, index] += settings.force_weight
            g[index] -= settings.force_weight * (forces[leg, k] / settings.mass)
    for i in range(6):
        H[i, i] += settings.base_weight
        g[i] -= settings.base_weight * base[i]
    for i in range(6, NUM_VELOCITIES):
        H[i, i] += settings.joint_weight
    _constrain(settings, mass_matrix, bias, jacobian, modes, normals, data)


@njit(cache=True)
def _constrain(settings, mass_matrix, bias, jacobian, modes, normals, data):
    mass, first = settings.mass, FORCE_ROWS * NUM_LEGS
    equalities, limits, lower, upper = data.equalities, data.limits, data.lower, data.upper
    pyramid_columns(normals, settings.friction, mass, limits)
    for leg in range(NUM_LEGS):
        for row in range(FORCE_ROWS * leg, FORCE_ROWS * (leg + 1)):
            lower[row], upper[row] = 0.0, np.inf
        upper[FORCE_ROWS * (leg + 1) - 1] = settings.max_force if bears(modes[leg]) else 0.0
    for i in range(NUM_VELOCITIES):
        for j in range(6):
            equalities[i, j] = mass_matrix[j, i]
        for j in range(NUM_JOINTS):
            limits[i, first + j] = mass_matrix[6 + j, i]
    for i in range(3 * NUM_LEGS):
        for j in range(6):
            equalities[NUM_VELOCITIES + i, j] = -mass * jacobian[i, j]
        for j in range(NUM_JOINTS):
            limits[NUM_VELOCITIES + i, first + j] = -mass * jacobian[i, 6 + j]
    for j in range(6):
        data.targets[j] = -bias[j]
    for j in range(NUM_JOINTS):
        lower[first + j] = -settings.efforts[j] - bias[6 + j]
        upper[first + j] = settings.efforts[j] - bias[6 + j]
