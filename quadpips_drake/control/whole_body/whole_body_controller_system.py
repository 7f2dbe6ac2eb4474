"""WholeBodyController: torques at 500 Hz that follow the MPC policy."""

from contextlib import nullcontext

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.control.whole_body.task_space_inverse_dynamics import TaskSpaceInverseDynamics
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.legs import NUM_JOINTS
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.whole_body_command import WholeBodyCommand


class WholeBodyController(LeafSystem):
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
    - feedforward_torque: vector (12,) [N m], joint order of the robot; within its effort limits. Updated at 1 / ``period``.
    - desired_joint_state: vector (24,): joint positions [rad], joint velocities [rad/s] for the joints' own PD control.
    - wbc_status: WholeBodyCommand: forces, foot modes, solver status, count of fallbacks.
    """

    def __init__(self, robot, config: WbcConfig | None = None, *, period: float = 0.002, timings=None):
        super().__init__()
        self.set_name("whole_body_controller")
        self._control = TaskSpaceInverseDynamics(robot, config)
        self._timings = timings
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(standing_state(robot)))
        self._policy = self.DeclareAbstractInputPort("mpc_policy", AbstractValue.Make(MpcPolicy.empty()))
        self._state = self.DeclareAbstractState(AbstractValue.Make(WholeBodyCommand.empty()))
        # The first torques must be there before the first step of the physics.
        self.DeclareInitializationUnrestrictedUpdateEvent(self._update)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, period, self._update)
        ticket = {self.abstract_state_ticket(self._state)}
        self.DeclareVectorOutputPort(
            "feedforward_torque", NUM_JOINTS, lambda c, out: out.SetFromVector(self._command(c).torque), ticket
        )
        self.DeclareVectorOutputPort("desired_joint_state", 2 * NUM_JOINTS, self._calc_joint_state, ticket)
        self.DeclareAbstractOutputPort(
            "wbc_status",
            lambda: AbstractValue.Make(WholeBodyCommand.empty()),
            lambda c, out: out.set_value(self._command(c)),
            ticket,
        )

    def _command(self, context) -> WholeBodyCommand:
        return context.get_abstract_state(int(self._state)).get_value()

    def _calc_joint_state(self, context, output):
        command = self._command(context)
        output.SetFromVector(np.concatenate((command.joint_positions, command.joint_velocities)))

    def _update(self, context, state):
        with self._timings.measure("whole_body_control") if self._timings else nullcontext():
            command = self._control.compute(
                self._robot_state.Eval(context), self._policy.Eval(context), self._command(context)
            )
        state.get_mutable_abstract_state(int(self._state)).set_value(command)
