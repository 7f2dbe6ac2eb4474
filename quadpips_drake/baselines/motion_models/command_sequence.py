"""Velocity commands for the walks that motion models are learned from: each changes when a step begins."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.baselines.motion_models.line_holding import Line, command_on_line
from quadpips_drake.baselines.motion_models.step_watch import StepWatch, watch_steps
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.robot_state import RobotState


@dataclass(frozen=True)
class HeldCommand:
    """A command and how long it is held."""

    velocity: tuple[float, float, float]
    """Forward, left [m/s], yaw rate [rad/s]; straight ahead, heading and line are held as well (``line_holding``)."""
    steps: int
    """[1]"""

    @property
    def is_straight(self) -> bool:
        """Whether it goes straight ahead."""
        return self.velocity[1] == 0.0 and self.velocity[2] == 0.0


@dataclass(frozen=True, eq=False)
class SequenceMemory(ImmutableValue):
    """How far a sequence of commands has come."""

    watch: StepWatch = field(default_factory=StepWatch)
    """The steps of the robot."""
    command: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """What is commanded now: forward, left [m/s], yaw rate [rad/s], (3,)."""
    line: Line | None = None
    """What is being held; None while sideways or turning."""
    begun: bool = False
    """Whether there was a look already, so that the robot is to walk."""


class CommandSequence:
    """Commands one after the other, each for its steps; the last one for ever."""

    def __init__(self, commands: list[HeldCommand]):
        """Args: the commands, at least one."""
        self._of_steps = [command for command in commands for _ in range(command.steps)]

    @property
    def steps(self) -> int:
        """How many steps they are held in all."""
        return len(self._of_steps)

    def first(self) -> np.ndarray:
        """The command before the first step, (3,)."""
        return np.array(self._of_steps[0].velocity)

    def update(self, memory: SequenceMemory, state: RobotState, feet_W: np.ndarray) -> SequenceMemory:
        """The memory after a look at the robot; arguments as of ``watch_steps``."""
        watch, begins = watch_steps(memory.watch, state, feet_W, memory.command)
        if not begins:
            return SequenceMemory(watch, memory.command if memory.begun else self.first(), memory.line, begun=True)
        held = self._of_steps[min(watch.exchange.count, self.steps) - 1]
        if not held.is_straight:
            return SequenceMemory(watch, np.array(held.velocity), None, begun=True)
        line = memory.line or Line(watch.state.position, watch.state.yaw)
        return SequenceMemory(watch, command_on_line(held.velocity[0], line, watch.state), line, begun=True)
