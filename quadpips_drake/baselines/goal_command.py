"""The twist towards the goal that the paper's baselines get: they know the goal and nothing else."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.control.references.velocity_reference import STANCE
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.robot_state import RobotState


@configuration
class GoalCommandConfig(StageConfig):
    """The twist towards the goal; numbers as in the harness of the paper's authors."""

    rate: float = stage_rate(10.0)
    """How often it looks where the goal is [Hz] (the authors': 10)."""

    speed: float = ranged(0.25, 0.0, 5.0)
    """Along the straight way to the goal [m/s] (the authors': 0.25; until November 2025: 0.5)."""
    yaw_gain: float = ranged(0.25, 0.0, 100.0)
    """Yaw rate by heading error [1/s] (the authors': 0.25; until November 2025: 0.5)."""
    stop_distance: float = ranged(0.25, 0.0, 100.0)
    """Nothing is commanded within this distance of the goal [m] (the authors': 0.25)."""
    gait: str = "trot"
    """In which to walk (the authors': trot)."""

    def __post_init__(self):
        super().__post_init__()
        load_gait(self.gait)


@dataclass(frozen=True, eq=False)
class GoalCommandMemory(ImmutableValue):
    """What was commanded last."""

    stamp: float
    """[s]"""
    velocity: np.ndarray
    """Forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot, (3,)."""
    gait: str
    """Name of the gait to walk in; "stance": stand."""
    distance: float
    """To the goal, of the base, in xy [m]; NaN before the first look."""

    @staticmethod
    def empty() -> "GoalCommandMemory":
        """Stand."""
        return GoalCommandMemory(-np.inf, np.zeros(3), STANCE, np.nan)

    @property
    def is_at_goal(self) -> bool:
        """Whether there is nothing to be done any more."""
        return bool(np.isfinite(self.distance)) and self.gait == STANCE


def goal_command(state: RobotState, goal: np.ndarray, config: GoalCommandConfig) -> GoalCommandMemory:
    """The command for a robot in ``state``: straight to the goal, turning its head there meanwhile.

    Args: measured state; x, y of the goal in W [m], (2,); numbers.
    """
    way = np.asarray(goal, dtype=float) - state.p_WB[:2]
    distance = float(np.hypot(*way))
    if distance <= config.stop_distance:
        return GoalCommandMemory(state.stamp, np.zeros(3), STANCE, distance)
    error = float(wrap_angle(np.arctan2(way[1], way[0]) - state.rpy_WB[2]))
    ahead, left = config.speed * np.cos(error), config.speed * np.sin(error)
    return GoalCommandMemory(state.stamp, np.array([ahead, left, config.yaw_gain * error]), config.gait, distance)
