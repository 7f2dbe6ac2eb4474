"""ScriptedCommand: a walk's commands, known beforehand."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import AbstractParameterIndex

from quadpips_drake.control.references.walk_command import WalkCommand, check_commands, command_at
from quadpips_drake.framework.systems import LeafSystem


class ScriptedCommand(LeafSystem):
    """Says the gait and the velocity that a list of commands has for the present time.

    The list is a parameter of the context: ``add`` gives it one more.

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
        self._commands = self.DeclareAbstractParameter(AbstractValue.Make(tuple(commands)))
        causes = {self.time_ticket(), self.abstract_parameter_ticket(AbstractParameterIndex(self._commands))}
        self.DeclareVectorOutputPort("velocity_command", 3, self._calc_velocity, causes)
        self.DeclareAbstractOutputPort("gait", lambda: AbstractValue.Make("stance"), self._calc_gait, causes)

    def add(self, root_context, command: WalkCommand) -> None:
        """Lets ``command`` hold from its time on, in a simulation that goes on; what will not hold any more is forgotten."""
        check_commands([command])
        context = self.GetMyMutableContextFromRoot(root_context)
        earlier = [c for c in self._commands_in(context) if c.time < command.time]
        due = [c for c in earlier if c.time <= root_context.get_time() + 1e-9]
        commands = (*due[-1:], *earlier[len(due) :], command)
        context.get_mutable_abstract_parameter(int(self._commands)).set_value(commands)

    def _commands_in(self, context) -> tuple[WalkCommand, ...]:
        return context.get_abstract_parameter(int(self._commands)).get_value()

    def _calc_velocity(self, context, output):
        output.SetFromVector(command_at(self._commands_in(context), context.get_time()).velocity)

    def _calc_gait(self, context, output):
        output.set_value(command_at(self._commands_in(context), context.get_time()).gait)
