"""Terms of the rigid-body dynamics by Drake's MultibodyPlant: what the kernels are held against."""

import numpy as np
from pydrake.math import RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable

from quadpips_drake.control.whole_body.robot_dynamics import NUM_VELOCITIES, DynamicsTerms
from quadpips_drake.values.legs import NUM_LEGS


class PlantDynamics:
    """Evaluates DynamicsTerms with a MultibodyPlant that holds nothing but the robot."""

    def __init__(self, robot):
        self._plant = MultibodyPlant(time_step=0.0)
        robot.add_to_plant(self._plant)
        self._plant.Finalize()
        self._context = self._plant.CreateDefaultContext()
        knees = [robot.joint_names[3 * leg + 2] for leg in range(NUM_LEGS)]
        frames = [self._plant.GetJointByName(knee).child_body().body_frame() for knee in knees]
        self._feet = list(zip(frames, np.asarray(robot.tree.foot_offset), strict=True))

    def evaluate(self, state) -> DynamicsTerms:
        """All terms at ``state``."""
        plant, context, world = self._plant, self._context, self._plant.world_frame()
        quaternion = RollPitchYaw(state.rpy_WB).ToQuaternion().wxyz()
        velocity = np.concatenate((state.w_WB, state.v_WB, state.joint_velocities))
        positions = np.concatenate((quaternion, state.p_WB, state.joint_positions))
        plant.SetPositionsAndVelocities(context, np.concatenate((positions, velocity)))
        jacobian, bias = np.empty((3 * NUM_LEGS, NUM_VELOCITIES)), np.empty(3 * NUM_LEGS)
        p_WF = np.empty((NUM_LEGS, 3))
        kV = JacobianWrtVariable.kV
        for leg, (frame, offset) in enumerate(self._feet):
            rows = slice(3 * leg, 3 * leg + 3)
            jacobian[rows] = plant.CalcJacobianTranslationalVelocity(context, kV, frame, offset, world, world)
            bias[rows] = plant.CalcBiasTranslationalAcceleration(context, kV, frame, offset, world, world).ravel()
            p_WF[leg] = plant.CalcPointsPositions(context, frame, offset, world).ravel()
        return DynamicsTerms(
            mass_matrix=plant.CalcMassMatrix(context),
            bias=plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context),
            foot_jacobian=jacobian,
            foot_bias=bias,
            p_WF=p_WF,
            v_WF=(jacobian @ velocity).reshape(NUM_LEGS, 3),
            velocity=velocity,
        )
