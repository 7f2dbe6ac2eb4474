"""Rigid-body dynamics of the robot alone, as whole-body control needs them."""

from dataclasses import dataclass

import numpy as np

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


class RobotDynamics:
    """Evaluates DynamicsTerms; tests hold them against a MultibodyPlant."""

    def __init__(self, robot):
        self._tree = robot.tree
        self._rotor_inertia = robot.rotor_inertia

    def evaluate(self, state: RobotState) -> DynamicsTerms:
        """All terms at the measured ``state``."""
        velocity = np.concatenate((state.w_WB, state.v_WB, state.joint_velocities))
        rotation = np.ascontiguousarray(state.R_WB)
        terms = dynamics_terms(self._tree, self._rotor_inertia, state.p_WB, rotation, state.joint_positions, velocity)
        return DynamicsTerms(*terms, velocity)
