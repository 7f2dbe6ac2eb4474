"""Linear motion models: what a velocity command does to base and feet within one step (Taouil et al., section III)."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.baselines.motion_models.state import (
    BASE_SHIFT,
    COMMAND,
    FEET_SHIFT,
    INPUT_SIGNS,
    INPUTS,
    MIRRORED_INPUTS,
    NEXT_VELOCITY,
    OUTPUT_SIGNS,
    OUTPUTS,
)
from quadpips_drake.values.immutable import ImmutableValue

MODEL_NAMES = ("cdm", "fdm", "cvm")
"""Displacement of the base (the paper's CoM), displacement of the feet, velocity of the base."""


@dataclass(frozen=True, eq=False)
class MotionModels(ImmutableValue):
    """CDM, FDM and CVM of one robot in one gait: outputs = coefficients[swing] @ inputs, layouts as in ``state``.

    Its arrays are C-contiguous float64, so that compiled code can take them as they are.
    """

    robot: str
    """Name of the robot."""
    gait: str
    """Name of the gait."""
    step_duration: float
    """Median time between two exchanges of the feet [s]."""
    coefficients: np.ndarray
    """By swing, output and input, (2, OUTPUTS, INPUTS); zero where a model does not use an input."""
    covariance: np.ndarray
    """Of the outputs' errors on data that were not trained on, by swing, (2, OUTPUTS, OUTPUTS)."""
    settings: dict = field(default_factory=dict)
    """The walk that the data were collected from: dotted key -> value, see ``walk_settings``."""
    top_speed: float = 0.0
    """Fastest forward command in the data [m/s]; of faster ones nothing is known. The slowest is 0."""

    @property
    def cdm(self) -> np.ndarray:
        """Displacement of the base, coefficients by swing, (2, 2, INPUTS)."""
        return self.coefficients[:, BASE_SHIFT]

    @property
    def fdm(self) -> np.ndarray:
        """Displacement of the swing feet, coefficients by swing and foot (fore, hind), (2, 2, 2, INPUTS)."""
        return self.coefficients[:, FEET_SHIFT].reshape(2, 2, 2, INPUTS)

    @property
    def cvm(self) -> np.ndarray:
        """Next velocity of the base, coefficients by swing, (2, 2, INPUTS)."""
        return self.coefficients[:, NEXT_VELOCITY]

    def predict(self, inputs: np.ndarray, swing) -> np.ndarray:
        """Outputs (..., OUTPUTS) for ``inputs`` (..., INPUTS) and the pair that swings, a number or an array (...)."""
        return (self.coefficients[swing] @ inputs[..., None])[..., 0]


def models_of_both_pairs(first: np.ndarray) -> np.ndarray:
    """Coefficients (2, OUTPUTS, INPUTS) of a walk without a preferred side, from those of swing 0, (OUTPUTS, INPUTS)."""
    second = OUTPUT_SIGNS[:, None] * (first * INPUT_SIGNS)[:, MIRRORED_INPUTS]
    return np.ascontiguousarray(np.stack((first, second)))


def ideal_coefficients(step_duration: float) -> np.ndarray:
    """Coefficients (2, OUTPUTS, INPUTS) of a walk that follows each command at once: base v T, feet 2 v T, velocity v.

    ``step_duration``: T, from exchange to exchange [s]. Nothing in it is learned.
    """
    first = np.zeros((OUTPUTS, INPUTS))
    command = np.arange(INPUTS)[COMMAND]
    for axis in range(2):
        first[BASE_SHIFT.start + axis, command[axis]] = step_duration
        first[[FEET_SHIFT.start + axis, FEET_SHIFT.start + 2 + axis], command[axis]] = 2.0 * step_duration
        first[NEXT_VELOCITY.start + axis, command[axis]] = 1.0
    return models_of_both_pairs(first)
