"""Small worlds for the search over commands: maps with gaps, a robot that stands before them, models of a walk."""

import numpy as np

from quadpips_drake.baselines.motion_models.line_holding import Line
from quadpips_drake.baselines.motion_models.models import MotionModels, ideal_coefficients, models_of_both_pairs
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmapConfig, foot_costmap
from quadpips_drake.baselines.motion_models.state import (
    BASE_SHIFT,
    COMMAND,
    CONSTANT,
    FEET,
    FEET_SHIFT,
    INPUTS,
    NEXT_VELOCITY,
    OUTPUTS,
    PAIRS,
    PREVIOUS_COMMAND,
    PREVIOUS_VELOCITY,
    TURN,
    VELOCITY,
    StepState,
)
from quadpips_drake.values.regions import GroundHeights

CELL = 0.01
STEP = 0.3
"""Duration [s]."""
FEET_B = np.array([[0.35, 0.2], [0.35, -0.2], [-0.35, 0.2], [-0.35, -0.2]])
LINE = Line(np.array([3.0, 0.0]), 0.0)
GOAL = np.array([3.0, 0.0])


def ground(gaps=(), *, step: tuple[float, float] | None = None, holes: np.ndarray | None = None):
    """A FootCostmap of level ground from x = -1 to 4 m with ``gaps`` (from, to) [m] of unknown ground across the way.

    ``step``: from which x on the ground is how much higher [m]; ``holes``: x, y of cells that are unknown, (n, 2).
    """
    height = np.zeros((500, 160), np.float32)
    x = -1.0 + CELL * (np.arange(500) + 0.5)
    if step is not None:
        height[x > step[0]] = step[1]
    for begin, end in gaps:
        height[(x > begin) & (x < end)] = np.nan
    if holes is not None:
        i, j = np.floor((holes - [-1.0, -0.8]) / CELL).astype(int).T
        height[i, j] = np.nan
    return foot_costmap(GroundHeights(0.0, np.array([-1.0, -0.8]), CELL, height), FootCostmapConfig())


def standing(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, swing: int = 0) -> StepState:
    """A robot at rest with its feet at their nominal places."""
    return StepState(np.array([x, y]), yaw, np.zeros(2), np.zeros(2), np.zeros(3), FEET_B, swing)


def ideal() -> MotionModels:
    """Models of a walk that follows each command at once."""
    return MotionModels("toy", "trot", STEP, ideal_coefficients(STEP), _covariance())


def sluggish() -> MotionModels:
    """Models that use every input: a walk with memory, whose feet return to their places."""
    first = np.zeros((OUTPUTS, INPUTS))
    for axis in range(2):
        v, before = VELOCITY.start + axis, PREVIOUS_VELOCITY.start + axis
        command, last = COMMAND.start + axis, PREVIOUS_COMMAND.start + axis
        first[NEXT_VELOCITY.start + axis, [v, before, command, last]] = 0.3, 0.05, 0.5, 0.15
        first[BASE_SHIFT.start + axis, [v, before, command, last]] = 0.14, 0.01, 0.10, 0.05
        for foot, leg in enumerate(PAIRS[0]):
            row = FEET_SHIFT.start + 2 * foot + axis
            first[row, [v, command, last]] = 0.2, 0.2, 0.1
            first[row, FEET.start + 2 * leg + axis], first[row, CONSTANT] = -0.8, 0.8 * FEET_B[leg, axis]
    first[BASE_SHIFT.start + 1, TURN] = 0.002, 0.001, 0.003, -0.001
    return MotionModels("toy", "trot", STEP, models_of_both_pairs(first), _covariance())


def _covariance() -> np.ndarray:
    return np.stack([np.diag(np.array([0.004, 0.004, 0.008, 0.008, 0.008, 0.008, 0.02, 0.02]) ** 2)] * 2)
