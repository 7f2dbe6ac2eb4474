"""What a walk is told to do, and when."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.gaits.gaits import load_gait


@dataclass
class WalkCommand:
    """Gait and velocity from a time on."""

    time: float = 0.0
    """From when on [s]."""
    gait: str = "stance"
    velocity: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Forward, left [m/s], yaw rate [rad/s] in the robot's heading frame."""


def check_commands(commands: list[WalkCommand]) -> None:
    """Refuses commands with unknown gaits, wrong numbers or in the wrong order (UserInputError)."""
    for command in commands:
        load_gait(command.gait)
        if len(command.velocity) != 3 or not np.isfinite(command.velocity).all():
            raise UserInputError(f"velocity must be VX,VY,WZ (m/s, m/s, rad/s), not {command.velocity}")
        if not (np.isfinite(command.time) and command.time >= 0.0):
            raise UserInputError(f"the time of a command must be a number >= 0, not {command.time}")
    times = [command.time for command in commands]
    if sorted(times) != times:
        raise UserInputError("commands must be in the order of their times")


def command_at(commands: list[WalkCommand], time: float) -> WalkCommand:
    """The command that holds at ``time`` [s]; before the first one, standing."""
    begun = [command for command in commands if command.time <= time + 1e-9]
    return begun[-1] if begun else WalkCommand()
