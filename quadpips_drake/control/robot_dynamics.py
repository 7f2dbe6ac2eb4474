"""Rigid-body dynamics of the robot alone, as whole-body control needs them."""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable

from quadpips_drake.robots.legs import NUM_JOINTS, NUM_LEGS
from quadpips_drake.robots.robot_state import RobotState

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
    """Evaluates DynamicsTerms with a MultibodyPlant that holds nothing but the robot.

    The plant's context is scratch memory: each call sets it completely, nothing of an earlier call survives.
    """

    def __init__(self, robot):
        self._plant = MultibodyPlant(time_step=0.0)
        model = robot.add_to_plant(self._plant)
        self._plant.Finalize()
        self._context = self._plant.CreateDefaultContext()
        self._world = self._plant.world_frame()
        joints = [self._plant.get_joint(j) for j in self._plant.GetJointIndices(model)]
        starts = [j.velocity_start() for j in joints if j.num_velocities() == 1]
        if starts != list(range(6, NUM_VELOCITIES)) or self._plant.num_velocities() != NUM_VELOCITIES:
            raise ValueError("expected a floating base followed by the 12 joints leg by leg")
        tree = robot.tree
        self._feet = [(joints_link(self._plant, robot, leg), np.asarray(tree.foot_offset[leg])) for leg in range(NUM_LEGS)]

    def _set_state(self, state: RobotState) -> np.ndarray:
        quaternion = RollPitchYaw(state.rpy_WB).ToQuaternion().wxyz()
        velocity = np.concatenate((state.w_WB, state.v_WB, state.joint_velocities))
        positions = np.concatenate((quaternion, state.p_WB, state.joint_positions))
        self._plant.SetPositionsAndVelocities(self._context, np.concatenate((positions, velocity)))
        return velocity

    def evaluate(self, state: RobotState) -> DynamicsTerms:
        """All terms at the measured ``state``."""
        plant, context = self._plant, self._context
        velocity = self._set_state(state)
        jacobian = np.empty((3 * NUM_LEGS, NUM_VELOCITIES))
        bias = np.empty(3 * NUM_LEGS)
        p_WF = np.empty((NUM_LEGS, 3))
        for leg, (frame, offset) in enumerate(self._feet):
            rows = slice(3 * leg, 3 * leg + 3)
            jacobian[rows] = plant.CalcJacobianTranslationalVelocity(
                context, JacobianWrtVariable.kV, frame, offset, self._world, self._world
            )
            bias[rows] = plant.CalcBiasTranslationalAcceleration(
                context, JacobianWrtVariable.kV, frame, offset, self._world, self._world
            ).ravel()
            p_WF[leg] = plant.CalcPointsPositions(context, frame, offset, self._world).ravel()
        return DynamicsTerms(
            mass_matrix=plant.CalcMassMatrix(context),
            bias=plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context),
            foot_jacobian=jacobian,
            foot_bias=bias,
            p_WF=p_WF,
            v_WF=(jacobian @ velocity).reshape(NUM_LEGS, 3),
            velocity=velocity,
        )


def joints_link(plant: MultibodyPlant, robot, leg: int):
    """Body frame of the link that the knee (KFE) of ``leg`` moves."""
    return plant.GetJointByName(robot.joint_names[3 * leg + 2]).child_body().body_frame()
