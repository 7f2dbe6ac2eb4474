"""Rigid-body dynamics of the robot alone, as whole-body control needs them."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from quadpips_drake.control.whole_body.robot_dynamics_kernels import dynamics_terms
from quadpips_drake.values.legs import NUM_JOINTS
from quadpips_drake.values.robot_state import RobotState

NUM_VELOCITIES = 6 + NUM_JOINTS
"""Generalised velocities [w_WB, v_WB, joint velocities]: Drake's order for a floating base, both in W."""


@dataclass(frozen=True, eq=False)
class DynamicsTerms:
    """Terms of M(q) vdot + bias(q, v) = [0; tau] + J(q)^T f, with vdot as in NUM_VELOCITIES; frame W."""

    mass_matrix: np.ndarray
    """(18, 18), with the rotors' inertia."""
    bias: np.ndarray
    """Coriolis, centrifugal and gravity terms, (18,)."""
    foot_jacobian: np.ndarray
    """d v_WF / d v of the four foot centres, stacked, (12, 18)."""
    foot_bias: np.ndarray
    """Jdot v of the foot centres [m/s^2], (12,)."""
    p_WF: np.ndarray
    """Foot centres [m], (4, 3)."""
    v_WF: np.ndarray
    """Their velocities [m/s], (4, 3)."""
    velocity: np.ndarray
    """Generalised velocity v, (18,)."""


def measured(state: RobotState) -> np.ndarray:
    """``state`` in one array, which compiled functions take sooner than six: position (3) and rotation (9, row by row) of
    the base, generalised velocities (18), joint angles (12)."""
    rotation = state.R_WB.ravel()
    return np.concatenate((state.p_WB, rotation, state.w_WB, state.v_WB, state.joint_velocities, state.joint_positions))


POSITION, ROTATION, VELOCITY, JOINTS = slice(0, 3), slice(3, 12), slice(12, 30), slice(30, 42)
"""Parts of such an array."""


@njit(cache=True)
def dynamics_at(tree, rotor_inertia, state, M, bias, J, foot_bias, p_WF, v_WF):
    """``dynamics_terms`` at a state as ``measured`` puts it."""
    rotation, terms = state[ROTATION].reshape((3, 3)), (M, bias, J, foot_bias, p_WF, v_WF)
    dynamics_terms(tree, rotor_inertia, state[POSITION], rotation, state[JOINTS], state[VELOCITY], *terms)


class RobotDynamics:
    """Evaluates DynamicsTerms; tests hold them against a MultibodyPlant."""

    def __init__(self, robot):
        self._tree = robot.tree
        self._rotor_inertia = np.array(robot.rotor_inertia, dtype=float)

    def evaluate(self, state: RobotState) -> DynamicsTerms:
        """All terms at the measured ``state``."""
        where = measured(state)
        terms = [np.empty(shape) for shape in ((18, 18), (18,), (12, 18), (12,), (4, 3), (4, 3))]
        dynamics_at(self._tree, self._rotor_inertia, where, *terms)
        return DynamicsTerms(*terms, where[VELOCITY])
