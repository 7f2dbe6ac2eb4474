"""WholeBodyController: torques at 500 Hz that follow the MPC policy."""

import numpy as np

from quadpips_drake.control.whole_body.task_space_inverse_dynamics import TaskSpaceInverseDynamics
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.legs import NUM_JOINTS
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.whole_body_command import WholeBodyCommand


class WholeBodyController(Stage):
    """Turns the MPC policy into joint torques by a quadratic program over accelerations and contact forces.

    min |A z - b|^2 over z = [vdot, f] such that M vdot + bias = [0; tau] + J^T f, f in friction cones, |tau| <= limits
    (QuadPiPS section VII-C), tasks ranked by weight or strictly by priority (``WbcConfig.method``; see
    TaskSpaceInverseDynamics). A failed program falls back to the last torques with joint damping, a failed level of a
    hierarchy to the levels above; both are counted in ``wbc_status``.

    .. pydrake_system::

        name: WholeBodyController
        input_ports:
        - robot_state
        - mpc_policy
        output_ports:
        - feedforward_torque
        - desired_joint_state
        - wbc_status

    - robot_state: RobotState, frame W.
    - mpc_policy: MpcPolicy, frame W; an empty one makes the robot hold its nominal stance by joint control.
    - feedforward_torque: vector (12,) [N m], joint order of the robot; within its effort limits. Updated
      at ``config.rate`` (500 Hz).
    - desired_joint_state: vector (24,): joint positions [rad], joint velocities [rad/s] for the joints' own PD control.
    - wbc_status: WholeBodyCommand: forces, foot modes, solver status, count of fallbacks.
    """

    def __init__(self, robot, config: WbcConfig | None = None, *, timings: StageTimings | None = None):
        # The first torques must be there before the first step of the physics.
        super().__init__(
            "whole_body_controller",
            config or WbcConfig(),
            memory=WholeBodyCommand.empty(),
            label="whole_body_control",
            timings=timings,
            first=FirstUpdate.AT_INITIALIZATION,
        )
        self._control = TaskSpaceInverseDynamics(robot, self.config)
        self.declare_input("robot_state", RobotState)
        self.declare_input("mpc_policy", MpcPolicy)
        self.declare_vector_output("feedforward_torque", NUM_JOINTS, lambda command: command.torque)
        self.declare_vector_output(
            "desired_joint_state",
            2 * NUM_JOINTS,
            lambda command: np.concatenate((command.joint_positions, command.joint_velocities)),
        )
        self.declare_output("wbc_status", WholeBodyCommand)

    def update(self, inputs: Inputs, memory: WholeBodyCommand, time: float) -> WholeBodyCommand:
        """One tick."""
        return self._control.compute(inputs.robot_state, inputs.mpc_policy, memory)
