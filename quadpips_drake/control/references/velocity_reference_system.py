"""VelocityReference: walking by velocity command, without a planner."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.control.references.velocity_reference import STANCE, VelocityReferenceConfig, VelocityWalk, WalkMemory
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.safety_status import SafetyStatus


class VelocityReference(LeafSystem):
    """Makes a rolling whole-body reference with Raibert footholds from a velocity command and a gait.

    The base reference integrates the command; a foot comes down at its nominal place below the base in the middle of its
    next stance, plus k sqrt(h / g) (v - v_ref) (M. Raibert, Legged Robots That Balance, 1986), on the plane through the
    points where the feet touched the ground last.

    .. pydrake_system::

        name: VelocityReference
        input_ports:
        - robot_state
        - velocity_command
        - gait
        - safety_status (optional)
        output_ports:
        - reference

    - robot_state: RobotState, frame W.
    - velocity_command: vector (3,): forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot.
    - gait: str, name of the gait to walk in; it may change at any time. "stance": slow down, step once on the spot, stand.
    - safety_status (optional): SafetyStatus; while it is unstable the robot is to stand where it is; then the walk begins
      anew from there.
    - reference: WholeBodyReference in absolute time, frame W, from now over the configured horizon; without samples before
      the first update. Updated at 1 / ``period``.
    """

    def __init__(self, robot, config: VelocityReferenceConfig | None = None, *, period: float = 0.02):
        super().__init__()
        self.set_name("velocity_reference")
        self._walk = VelocityWalk(robot, config)
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(standing_state(robot)))
        self._command = self.DeclareVectorInputPort("velocity_command", 3)
        self._gait = self.DeclareAbstractInputPort("gait", AbstractValue.Make(STANCE))
        self._safety = self.DeclareAbstractInputPort("safety_status", AbstractValue.Make(SafetyStatus.empty()))
        self._state = self.DeclareAbstractState(AbstractValue.Make(WalkMemory.empty()))
        self.DeclareInitializationUnrestrictedUpdateEvent(self._update)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, period, self._update)
        self.DeclareAbstractOutputPort(
            "reference",
            lambda: AbstractValue.Make(WholeBodyReference.empty()),
            lambda context, output: output.set_value(self._memory(context).reference),
            {self.abstract_state_ticket(self._state)},
        )

    def _memory(self, context) -> WalkMemory:
        return context.get_abstract_state(int(self._state)).get_value()

    def _update(self, context, state):
        gait, command, memory = self._gait.Eval(context), self._command.Eval(context), self._memory(context)
        if self._safety.HasValue(context) and self._safety.Eval(context).unstable:
            gait, command, memory = STANCE, np.zeros(3), WalkMemory.empty()
        memory = self._walk.update(memory, self._robot_state.Eval(context), command, load_gait(gait))
        state.get_mutable_abstract_state(int(self._state)).set_value(memory)
