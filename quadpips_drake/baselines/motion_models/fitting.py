"""Least squares in closed form: the models of Taouil et al., and variants of them for their Table I.

All steps are fitted as those of one pair of feet: the other pair's are taken as a mirror shows them (``state``), so that
each step counts for both.

A search uses the models on their own predictions. In data the feet vary little against each other, so that least squares
alone explain what is left over with large coefficients of opposite signs: as good one step ahead, but errors of millimetres
in the feet then grow tenfold every two steps. So the inputs are taken to be off as they are in a search: with x + e instead
of x, e of zero mean and covariance E, the expected squared error has its least where the sum of squares plus n tr(C E C')
has it (C. M. Bishop, Training with Noise is Equivalent to Tikhonov Regularization, Neural Computation 7(1), 1995).
"""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.baselines.motion_models.state import (
    CONSTANT,
    FEET,
    INPUTS,
    OUTPUTS,
    PREVIOUS_COMMAND,
    PREVIOUS_VELOCITY,
    TURN,
    VELOCITY,
)
from quadpips_drake.baselines.motion_models.step_data import Steps
from quadpips_drake.errors import UserInputError

INPUT_NAMES = (
    *("forward velocity", "left velocity", "previous forward velocity", "previous left velocity"),
    *("forward command", "left command", "previous forward command", "previous left command"),
    *(f"{axis} of foot {leg}" for leg in ("LF", "RF", "LH", "RH") for axis in "xy"),
    "constant",
    *("yaw rate", "previous yaw rate", "commanded yaw rate", "previous commanded yaw rate"),
)
_EARLIER_TURN = (slice(TURN.start + 1, TURN.start + 2), slice(TURN.stop - 1, TURN.stop))
LINEAR_VARIANTS = {
    "full": (),
    "no history": (PREVIOUS_VELOCITY, PREVIOUS_COMMAND, *_EARLIER_TURN),
    "no feet": (FEET,),
    "no turn": (TURN,),
    "plain": (),
}
"""What each of the linear models of Table I goes without; "no turn" has x^t of equation (2) as it stands in the paper."""
PLAIN = "plain"
"""That one of them which is fitted as if all inputs were exact; the others with INPUT_ERRORS."""
VELOCITY_ERROR, FEET_ERROR, TURN_ERROR = 0.004, 0.002, 0.004
"""Standard deviations of inputs that a search predicts [m/s, m, rad/s]; commands are known."""
LEAST_SPREAD = 1e-6
"""An input that varies less than this [its unit] never varied: nothing can be learned about it."""
_LEAST_RATIO = 1e-9
"""Of the singular values of scaled inputs, smallest to largest."""
_RIDGE = 1e-3
"""Of the quadratic model, whose inputs nearly depend on each other; per sample and standard deviation."""


def _input_errors() -> np.ndarray:
    errors = np.zeros(INPUTS)
    errors[VELOCITY] = errors[PREVIOUS_VELOCITY] = VELOCITY_ERROR
    errors[FEET], errors[TURN] = FEET_ERROR, TURN_ERROR
    return errors


INPUT_ERRORS = _input_errors()
"""Of all inputs, (INPUTS,)."""
EXACT_INPUTS = np.zeros(INPUTS)
"""What least squares alone assume."""


def fit_linear(steps: Steps, without: tuple[slice, ...] = (), input_errors: np.ndarray = INPUT_ERRORS) -> np.ndarray:
    """Returns the coefficients of swing 0, (OUTPUTS, INPUTS), that make the expected squared errors of ``steps`` least.

    Args:
        steps: at least twice as many as there are inputs.
        without: inputs that are left out; their coefficients are zero.
        input_errors: standard deviations of independent errors of the inputs where the models will be used, (INPUTS,).

    Raises:
        UserInputError: there are too few steps, or they do not tell the inputs' effects from each other.
    """
    used = np.ones(INPUTS, dtype=bool)
    for inputs in without:
        used[inputs] = False
    if len(steps) < 2 * INPUTS:
        raise UserInputError(f"{len(steps)} steps are too few for {INPUTS} inputs: at least {2 * INPUTS} are needed")
    x, y = steps.as_one_pair()
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise UserInputError("the data hold NaN or infinity")
    _check_variety(x, used)
    coefficients = np.zeros((OUTPUTS, INPUTS))
    off = np.sqrt(len(x)) * np.diag(input_errors)[:, used]
    coefficients[:, used] = np.linalg.lstsq(
        np.vstack((x[:, used], off)), np.vstack((y, np.zeros((INPUTS, OUTPUTS)))), rcond=None
    )[0].T
    return coefficients


def fit_variant(steps: Steps, name: str) -> np.ndarray:
    """Coefficients of swing 0, (OUTPUTS, INPUTS), of one of LINEAR_VARIANTS."""
    return fit_linear(steps, LINEAR_VARIANTS[name], EXACT_INPUTS if name == PLAIN else INPUT_ERRORS)


def _check_variety(x: np.ndarray, used: np.ndarray) -> None:
    """Raises UserInputError if some of the ``used`` inputs never varied, or only together."""
    columns = np.flatnonzero(used & (np.arange(INPUTS) != CONSTANT))
    spread = x[:, columns].std(axis=0)
    still = [INPUT_NAMES[column] for column, value in zip(columns, spread, strict=True) if value < LEAST_SPREAD]
    if still:
        raise UserInputError(f"in the data these never varied: {', '.join(still)}; collect other commands")
    _, values, directions = np.linalg.svd((x[:, columns] - x[:, columns].mean(axis=0)) / spread, full_matrices=False)
    if values[-1] < _LEAST_RATIO * values[0]:
        bound = [INPUT_NAMES[columns[i]] for i in np.flatnonzero(np.abs(directions[-1]) > 0.1)]
        raise UserInputError(f"in the data these varied only together: {', '.join(bound)}; collect other commands")


@dataclass(frozen=True, eq=False)
class QuadraticModel:
    """A polynomial of the second degree in all inputs, by ridge regression on scaled features."""

    mean: np.ndarray
    """Of the features, (m,)."""
    scale: np.ndarray
    """(m,)"""
    offset: np.ndarray
    """(OUTPUTS,)"""
    weights: np.ndarray
    """(m, OUTPUTS)"""

    def predict_first(self, x: np.ndarray) -> np.ndarray:
        """Outputs (n, OUTPUTS) of swing 0 for inputs (n, INPUTS)."""
        return (_squares(x) - self.mean) / self.scale @ self.weights + self.offset


def fit_quadratic(steps: Steps) -> QuadraticModel:
    """Fits a QuadraticModel to the steps."""
    x, y = steps.as_one_pair()
    features = _squares(x)
    mean, scale = features.mean(axis=0), np.maximum(features.std(axis=0), LEAST_SPREAD)
    scaled, offset = (features - mean) / scale, y.mean(axis=0)
    weights = np.linalg.solve(scaled.T @ scaled + _RIDGE * len(x) * np.eye(scaled.shape[1]), scaled.T @ (y - offset))
    return QuadraticModel(mean, scale, offset, weights)


def _squares(x: np.ndarray) -> np.ndarray:
    """All inputs but the constant, and their products, (n, m)."""
    x = np.delete(x, CONSTANT, axis=1)
    first, second = np.triu_indices(x.shape[1])
    return np.concatenate((x, x[:, first] * x[:, second]), axis=1)


def left_out_residuals(steps: Steps) -> np.ndarray:
    """Errors (n, OUTPUTS) of linear models on each walk that were fitted to all others, as if swing 0 had done all steps."""
    x, y = steps.as_one_pair()
    residuals = np.empty_like(y)
    for walk in np.unique(steps.walk):
        out = steps.walk == walk
        residuals[out] = y[out] - x[out] @ fit_linear(steps.chosen(~out)).T
    return residuals
