"""SequencedCommand: what the walks are told that motion models are learned from."""

from quadpips_drake.baselines.motion_models.command_sequence import CommandSequence, HeldCommand, SequenceMemory
from quadpips_drake.baselines.motion_models.exchange import SAMPLE_RATE
from quadpips_drake.control.references.velocity_reference import STANCE
from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.framework.stage_config import StageConfig
from quadpips_drake.values.robot_state import RobotState


class SequencedCommand(Stage):
    """Gives a gait one velocity command after the other; a command changes when the feet are exchanged, never in a step.

    Exchanges are found in the contacts of the feet, as a planner has to that does not know how the robot walks (Taouil et
    al., section III: decisions are made in full stance phases).

    .. pydrake_system::

        name: SequencedCommand
        input_ports:
        - robot_state
        output_ports:
        - velocity_command
        - gait

    - robot_state: RobotState, frame W.
    - velocity_command: vector (3,): forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot. Updated at
      200 Hz.
    - gait: str, name of the gait; "stance" until it starts. Updated at 200 Hz.
    """

    def __init__(self, robot, gait: str, commands: list[HeldCommand], *, start: float = 0.5):
        """Args: model of the robot; name of the gait; commands in order; when the walk begins [s]."""
        super().__init__(
            "command",
            StageConfig(rate=SAMPLE_RATE),
            memory=SequenceMemory(),
            first=FirstUpdate.AFTER_ONE_PERIOD,
        )
        self._robot, self._gait, self._start = robot, gait, start
        self.sequence = CommandSequence(commands)
        self.declare_input("robot_state", RobotState)
        self.declare_vector_output("velocity_command", 3, lambda memory: memory.command)
        self.declare_output("gait", str, self._gait_of, example=STANCE)

    def update(self, inputs: Inputs, memory: SequenceMemory, time: float) -> SequenceMemory:
        """Looks at the feet."""
        state = inputs.robot_state
        if not state.is_known or time < self._start:
            return memory
        return self.sequence.update(memory, state, self._robot.foot_positions_W(state))

    def _gait_of(self, memory: SequenceMemory) -> str:
        """The gait, from when the first command is there."""
        return self._gait if memory.begun else STANCE
