"""What a walk is told to do, and when."""

from collections.abc import Sequence

from quadpips_drake.configuration.schema import MAX_DURATION, configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.gaits.gaits import load_gait


@configuration
class WalkCommand:
    """Gait and velocity from a time on."""

    time: float = ranged(0.0, 0.0, MAX_DURATION)
    """From when on [s]."""
    gait: str = "stance"
    """Name of the gait."""
    velocity: list[float] = ranged([0.0, 0.0, 0.0], -100.0, 100.0)
    """Forward, left [m/s], yaw rate [rad/s] in the robot's heading frame."""


def check_commands(commands: Sequence[WalkCommand]) -> None:
    """Refuses commands with unknown gaits or in the wrong order (UserInputError)."""
    for command in commands:
        load_gait(command.gait)
    times = [command.time for command in commands]
    if sorted(times) != times:
        raise UserInputError("commands must be in the order of their times")


def command_at(commands: Sequence[WalkCommand], time: float) -> WalkCommand:
    """The command that holds at ``time`` [s]; before the first one, standing."""
    begun = [command for command in commands if command.time <= time + 1e-9]
    return begun[-1] if begun else WalkCommand()
