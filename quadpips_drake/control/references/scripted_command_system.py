"""ScriptedCommand: a walk's commands, known beforehand."""

from pydrake.common.value import AbstractValue

from quadpips_drake.control.references.walk_command import WalkCommand, check_commands, command_at
from quadpips_drake.framework.systems import LeafSystem


class ScriptedCommand(LeafSystem):
    """Says the gait and the velocity that a list of commands has for the present time.

    .. pydrake_system::

        name: ScriptedCommand
        output_ports:
        - velocity_command
        - gait

    - velocity_command: vector (3,): forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot; zero before the
      first command.
    - gait: str, name of a gait; "stance" before the first command.
    """

    def __init__(self, commands: list[WalkCommand]):
        super().__init__()
        self.set_name("command")
        check_commands(commands)
        self._commands = list(commands)
        time = {self.time_ticket()}
        self.DeclareVectorOutputPort("velocity_command", 3, self._calc_velocity, time)
        self.DeclareAbstractOutputPort("gait", lambda: AbstractValue.Make("stance"), self._calc_gait, time)

    def _calc_velocity(self, context, output):
        output.SetFromVector(command_at(self._commands, context.get_time()).velocity)

    def _calc_gait(self, context, output):
        output.set_value(command_at(self._commands, context.get_time()).gait)
