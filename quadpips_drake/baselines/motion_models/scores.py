"""How far predictions are off, with intervals; and what of it agrees with the paper's Table I.

Of predictions several steps ahead, each made of the one before as a search makes them, only the errors are carried along:
positions of base and feet and the velocities are what was measured, and what the models were off so far on top. Heading and
yaw rate are as measured.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from quadpips_drake.baselines.motion_models.models import MODEL_NAMES
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

FORWARD = {
    "cdm": [BASE_SHIFT.start],
    "fdm": [FEET_SHIFT.start, FEET_SHIFT.start + 2],
    "cvm": [NEXT_VELOCITY.start],
}
"""Outputs along x, by model."""
LEFT = {name: [column + 1 for column in columns] for name, columns in FORWARD.items()}
"""Outputs along y, by model."""
UNITS = {"cdm": "m", "fdm": "m", "cvm": "m/s"}
RESAMPLES = 1000
"""Of the bootstrap."""
_BLOCK = 6
"""Neighbouring steps that are drawn together [1]: their errors know each other (A. C. Davison, D. V. Hinkley, Bootstrap
Methods and their Application, 1997, section 8.2.3)."""
HORIZON = 7
"""Steps ahead; the longest of the paper's."""


@dataclass(frozen=True)
class Interval:
    """A figure with its 95 % interval."""

    value: float
    low: float
    high: float


def residuals_of(predict: Callable[[np.ndarray], np.ndarray], steps: Steps) -> np.ndarray:
    """Predictions less what came out, (n, OUTPUTS), as if swing 0 had done all steps.

    ``predict``: inputs (n, INPUTS) -> outputs (n, OUTPUTS) of swing 0.
    """
    x, y = steps.as_one_pair()
    return predict(x) - y


def figures(residuals: np.ndarray, columns: dict[str, list[int]]) -> dict[str, dict[str, float]]:
    """By model: true mean absolute error, root of the mean square, and mean signed error, over its ``columns``."""
    result = {}
    for name in MODEL_NAMES:
        errors = residuals[:, columns[name]]
        result[name] = {
            "mae": float(np.abs(errors).mean()),
            "rmse": float(np.sqrt((errors**2).mean())),
            "mean": float(errors.mean()),
        }
    return result


def bootstrap_of(walk: np.ndarray, seed: int = 0) -> list[np.ndarray]:
    """RESAMPLES draws of as many steps as there are, in blocks of neighbours of one walk: lists of indices.

    ``walk``: number of the walk of each step, steps in order, (n,).
    """
    rng, blocks = np.random.default_rng([seed, 29]), []
    for number in np.unique(walk):
        members = np.flatnonzero(walk == number)
        blocks += [members[first : first + _BLOCK] for first in range(0, len(members), _BLOCK)]
    draws = rng.integers(len(blocks), size=(RESAMPLES, len(blocks)))
    return [np.concatenate([blocks[i] for i in draw]) for draw in draws]


def rmse_interval(residuals: np.ndarray, columns: list[int], draws: list[np.ndarray]) -> Interval:
    """The RMSE over ``columns`` and its interval."""
    squares = (residuals[:, columns] ** 2).mean(axis=1)
    return _interval(float(np.sqrt(squares.mean())), [np.sqrt(squares[draw].mean()) for draw in draws])


def excess_interval(residuals: np.ndarray, base: np.ndarray, columns: list[int], draws: list[np.ndarray]) -> Interval:
    """By how much the RMSE is above that of ``base`` on the same steps, as part of that, and its interval."""
    mine, theirs = ((r[:, columns] ** 2).mean(axis=1) for r in (residuals, base))

    def excess(which):
        return np.sqrt(mine[which].mean() / theirs[which].mean()) - 1.0

    return _interval(float(excess(slice(None))), [excess(draw) for draw in draws])


def _interval(value: float, drawn: list[float]) -> Interval:
    low, high = np.quantile(drawn, (0.025, 0.975))
    return Interval(value, float(low), float(high))


def contradictions(excess: dict[str, dict[str, Interval]]) -> list[str]:
    """What of the paper's Table I does not hold here, one line each; ``excess``: by variant and model, over the full input.

    The paper's claims: each linear model is best with its full input; without history it is worst, without feet worse
    than full, for the CDM less so; the second degree is worse than linear.
    """
    lines = []
    for model in MODEL_NAMES:
        name, value = model.upper(), {variant: entry[model] for variant, entry in excess.items()}
        for variant in ("no history", "no feet", "quadratic"):
            if value[variant].value <= 0.0:
                lines.append(f"{name}: {variant} is no worse than the full linear model ({_percent(value[variant])})")
            elif value[variant].low <= 0.0:
                lines.append(f"{name}: that {variant} is worse could be chance ({_percent(value[variant])})")
        if value["no feet"].value >= value["no history"].value:
            words = f"({_percent(value['no feet'])} against {_percent(value['no history'])})"
            lines.append(f"{name}: missing feet cost as much as missing history or more {words}")
        if value["network"].high < 0.0:
            lines.append(f"{name}: a small network is better than the linear model ({_percent(value['network'])})")
    if excess["no feet"]["cdm"].value >= min(excess["no feet"][model].value for model in ("fdm", "cvm")):
        lines.append("CDM: missing feet do not cost less than for the other models")
    return lines


def _percent(interval: Interval) -> str:
    return f"{interval.value:+.1%}, 95 % {interval.low:+.1%} to {interval.high:+.1%}"


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
