"""How far predictions of several steps are off, each made of the one before, as a search makes them.

Of a prediction only its error is carried along: positions of base and feet and the velocities are what was measured, and
what the models were off so far on top. Heading and yaw rate are as measured.
"""

from collections.abc import Callable

import numpy as np

from quadpips_drake.baselines.motion_models.state import (
    BASE_SHIFT,
    COMMAND,
    FEET,
    FEET_SHIFT,
    NEXT_VELOCITY,
    PAIRS,
    PREVIOUS_COMMAND,
    PREVIOUS_VELOCITY,
    VELOCITY,
    mirrored_inputs,
    mirrored_outputs,
)
from quadpips_drake.baselines.motion_models.step_data import Steps

HORIZON = 7
"""Steps ahead; the longest of the paper's."""


def foothold_errors(
    predict: Callable[[np.ndarray], np.ndarray], steps: Steps, horizon: int = HORIZON, *, most_left: float = np.inf
) -> np.ndarray:
    """Predicted less real footholds of the swing feet, along x and y of the heading frame [m], (n, horizon, 2 feet, 2).

    Args:
        predict: inputs (m, INPUTS) -> outputs (m, OUTPUTS) of swing 0.
        steps: in order; each run of ``horizon`` of them, the one right after the other, is predicted from its beginning
            with the commands that were given.
        horizon: [1]
        most_left: runs with faster commands to the side than this are left out [m/s].
    """
    first = _beginnings(steps, horizon, most_left)
    base, feet = np.zeros((len(first), 2)), np.zeros((len(first), 4, 2))
    velocity, before = np.zeros((2, len(first), 2))
    errors = np.empty((len(first), horizon, 2, 2))
    for k in range(horizon):
        x, swing = steps.inputs[first + k].copy(), steps.swing[first + k]
        x[:, VELOCITY] += velocity
        x[:, PREVIOUS_VELOCITY] += before
        x[:, FEET] += (feet - base[:, None]).reshape(-1, 8)
        wrong = _predicted(predict, x, swing) - steps.outputs[first + k]
        legs = np.array(PAIRS)[swing]
        rows = np.arange(len(first))[:, None]
        feet[rows, legs] += wrong[:, FEET_SHIFT].reshape(-1, 2, 2)
        base = base + wrong[:, BASE_SHIFT]
        velocity, before = wrong[:, NEXT_VELOCITY], velocity
        errors[:, k] = feet[rows, legs]
    return errors


def rmse_by_step(errors: np.ndarray) -> list[float]:
    """Of ``foothold_errors`` along x, over both feet [m]."""
    return [float(value) for value in np.sqrt((errors[..., 0] ** 2).mean(axis=(0, 2)))] if len(errors) else []


def _predicted(predict, x: np.ndarray, swing: np.ndarray) -> np.ndarray:
    """Outputs of the steps, by a model of swing 0 alone."""
    other = (swing == 1)[:, None]
    y = predict(np.where(other, mirrored_inputs(x), x))
    return np.where(other, mirrored_outputs(y), y)


def _beginnings(steps: Steps, horizon: int, most_left: float) -> np.ndarray:
    """Indices of the steps with which a run begins: what the next inputs say of the step before is what was commanded."""
    x, count = steps.inputs, max(len(steps) - horizon + 1, 0)
    follows = (
        (steps.walk[1:] == steps.walk[:-1])
        & (steps.swing[1:] != steps.swing[:-1])
        & (x[1:, PREVIOUS_COMMAND] == x[:-1, COMMAND]).all(axis=1)
        & (x[1:, PREVIOUS_VELOCITY] == x[:-1, VELOCITY]).all(axis=1)
    )
    slow = np.abs(x[:, COMMAND.stop - 1]) <= most_left
    runs = [i for i in range(count) if follows[i : i + horizon - 1].all() and slow[i : i + horizon].all()]
    return np.array(runs, dtype=int)
