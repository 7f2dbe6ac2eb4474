"""A slow hold of heading and line beside the velocity that is planned; the same when data are collected."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.baselines.motion_models.state import StepState
from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.values.immutable import ImmutableValue

HEADING_GAIN, LARGEST_TURN = 0.8, 0.2
"""Yaw rate per yaw off the line [1/s], and the most of it [rad/s]."""
OFFSET_GAIN, LARGEST_DRIFT = 0.5, 0.1
"""Velocity towards the line per distance from it [1/s], and the most of it [m/s]."""


@dataclass(frozen=True, eq=False)
class Line(ImmutableValue):
    """What the robot is to walk along."""

    point: np.ndarray
    """A point on it, x, y in W [m], (2,)."""
    heading: float
    """Its direction in W [rad]."""


def command_on_line(forward: float, line: Line, state: StepState) -> np.ndarray:
    """The command (forward, left [m/s], yaw rate [rad/s]) that walks at ``forward`` [m/s] and keeps to the line, (3,)."""
    turn = wrap_angle(line.heading - state.yaw)
    offset = (yaw_matrix(line.heading)[:2, :2].T @ (state.position - line.point))[1]
    left = np.clip(-OFFSET_GAIN * offset, -LARGEST_DRIFT, LARGEST_DRIFT)
    return np.array([forward, left, np.clip(HEADING_GAIN * turn, -LARGEST_TURN, LARGEST_TURN)])
