"""The network of footholds: where our foothold search would put a foot, seen from where a heuristic wants it."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.baselines.learned_footholds.swing_view import INPUTS
from quadpips_drake.values.immutable import ImmutableValue

HIDDEN = 48
"""Units of each of two layers."""
OUTPUTS = 2
"""Offset of the foothold ahead and outward [m]."""
SHAPES = {
    "mean": (INPUTS,),
    "scale": (INPUTS,),
    "matrix_1": (INPUTS, HIDDEN),
    "bias_1": (HIDDEN,),
    "matrix_2": (HIDDEN, HIDDEN),
    "bias_2": (HIDDEN,),
    "matrix_3": (HIDDEN, OUTPUTS),
    "bias_3": (OUTPUTS,),
}
"""Of the arrays, by name."""


@dataclass(frozen=True, eq=False)
class FootholdNetwork(ImmutableValue):
    """Two layers of tanh units on scaled inputs; runs without torch."""

    robot: str
    """Whose footholds."""
    cell: float
    """Side of a cell of the patch of heights [m]."""
    mean: np.ndarray
    """Of the inputs, (INPUTS,)."""
    scale: np.ndarray
    """By which they are divided then, (INPUTS,)."""
    matrix_1: np.ndarray
    """(INPUTS, HIDDEN)"""
    bias_1: np.ndarray
    """(HIDDEN,)"""
    matrix_2: np.ndarray
    """(HIDDEN, HIDDEN)"""
    bias_2: np.ndarray
    """(HIDDEN,)"""
    matrix_3: np.ndarray
    """(HIDDEN, OUTPUTS)"""
    bias_3: np.ndarray
    """(OUTPUTS,)"""

    def offsets(self, inputs: np.ndarray) -> np.ndarray:
        """Offsets from the wishes, ahead and outward [m], (n, OUTPUTS), for inputs (n, INPUTS) as SwingView has them."""
        h = np.tanh((inputs - self.mean) / self.scale @ self.matrix_1 + self.bias_1)
        return np.tanh(h @ self.matrix_2 + self.bias_2) @ self.matrix_3 + self.bias_3
