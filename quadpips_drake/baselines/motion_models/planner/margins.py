"""How far footholds have to stay from unsafe cells: a constant, or as many standard deviations as the models err by.

The errors of linear models grow along the horizon by themselves, whatever is commanded: with x' = A x + B u + e, e of
covariance Q, the covariance of x goes on as A P A' + Q.
"""

import numpy as np

from quadpips_drake.baselines.motion_models.models import MotionModels
from quadpips_drake.baselines.motion_models.state import (
    BASE_SHIFT,
    FEET,
    FEET_SHIFT,
    NEXT_VELOCITY,
    PAIRS,
    PREVIOUS_VELOCITY,
    VELOCITY,
)

_SIZE = 14
"""Of what is carried along: position of the base (2), velocities now and before (4), feet in B (8)."""
_POSITION, _VELOCITY, _PREVIOUS, _FEET = slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 14)


def foothold_deviations(models: MotionModels, swing: int, steps: int) -> np.ndarray:
    """Standard deviations of where the fore and the hind swing foot come down, in the worst direction [m], (steps, 2).

    Args:
        models: with the covariance of their errors.
        swing: which of PAIRS swings first.
        steps: how many.
    """
    covariance, deviations = np.zeros((_SIZE, _SIZE)), np.zeros((steps, 2))
    for step in range(steps):
        A, G = _transition(models, swing)
        covariance = A @ covariance @ A.T + G @ models.covariance[swing] @ G.T
        for foot, leg in enumerate(PAIRS[swing]):
            select = np.zeros((2, _SIZE))
            select[:, _POSITION] = np.eye(2)
            select[:, _FEET.start + 2 * leg : _FEET.start + 2 * leg + 2] = np.eye(2)
            deviations[step, foot] = np.sqrt(max(np.linalg.eigvalsh(select @ covariance @ select.T)[-1], 0.0))
        swing = 1 - swing
    return deviations


def clearances(models: MotionModels, swing: int, steps: int, least: float, sigmas: float) -> np.ndarray:
    """Least distance of the fore and of the hind swing foot to unsafe cells, by step [m], (steps, 2)."""
    if sigmas <= 0.0:
        return np.full((steps, 2), float(least))
    return np.maximum(least, sigmas * foothold_deviations(models, swing, steps))


def _transition(models: MotionModels, swing: int) -> tuple[np.ndarray, np.ndarray]:
    """What becomes within a step of errors that there are, (_SIZE, _SIZE), and of those of its outputs, (_SIZE, OUTPUTS)."""
    coefficients = models.coefficients[swing]
    G = np.zeros((_SIZE, coefficients.shape[0]))
    G[_POSITION, BASE_SHIFT] = np.eye(2)
    G[_VELOCITY, NEXT_VELOCITY] = np.eye(2)
    for leg in range(4):
        at = _FEET.start + 2 * leg
        G[at : at + 2, BASE_SHIFT] = -np.eye(2)
    for foot, leg in enumerate(PAIRS[swing]):
        at, column = _FEET.start + 2 * leg, FEET_SHIFT.start + 2 * foot
        G[at : at + 2, column : column + 2] = np.eye(2)
    kept = np.zeros((_SIZE, _SIZE))
    kept[_POSITION, _POSITION], kept[_FEET, _FEET] = np.eye(2), np.eye(8)
    kept[_PREVIOUS, _VELOCITY] = np.eye(2)
    inputs = np.zeros((coefficients.shape[1], _SIZE))
    inputs[VELOCITY, _VELOCITY], inputs[PREVIOUS_VELOCITY, _PREVIOUS], inputs[FEET, _FEET] = np.eye(2), np.eye(2), np.eye(8)
    return kept + G @ coefficients @ inputs, G
