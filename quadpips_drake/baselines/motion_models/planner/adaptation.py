"""Learning while walking: recursive least squares, step by step, from the models that were learned before.

With forgetting factor l, inputs x and outputs y of a step, and the matrix P of what is not known of the coefficients,

    k = P x / (l + x' P x),   C <- C + (y - C x) k',   P <- (P - k x' P) / l

(e.g. Astrom and Wittenmark, Adaptive Control, section 2.2). As in training a mirror lets each step count for both pairs.
"""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.baselines.motion_models.models import MotionModels, models_of_both_pairs
from quadpips_drake.baselines.motion_models.state import CONSTANT, FEET, INPUTS, TURN, mirrored_inputs, mirrored_outputs
from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.values.immutable import ImmutableValue

_SPREAD = np.full(INPUTS, 0.3)
"""How much inputs usually vary [their unit]."""
_SPREAD[FEET], _SPREAD[CONSTANT], _SPREAD[TURN] = 0.1, 1.0, 0.2


@configuration
class AdaptationConfig:
    """Whether, and how fast, models change while the robot walks."""

    enabled: bool = False
    """Whether learned models go on learning."""
    forgetting: float = ranged(0.98, 0.5, 1.0)
    """What an earlier step counts against one that is one step newer [1]; 1: nothing is forgotten."""
    doubt: float = ranged(0.05, 0.0, 100.0)
    """How little the models are trusted at the beginning: the information of one step against theirs [1]."""


@dataclass(frozen=True, eq=False)
class Adaptation(ImmutableValue):
    """Models as they are believed now."""

    models: MotionModels
    doubt: np.ndarray
    """P, of swing 0, (INPUTS, INPUTS)."""
    steps: int = 0
    """From how many they have learned."""

    @staticmethod
    def begin(models: MotionModels, config: AdaptationConfig) -> "Adaptation":
        """Before the first step."""
        return Adaptation(models, _first_doubt(config))

    def after(self, inputs: np.ndarray, outputs: np.ndarray, swing: int, config: AdaptationConfig) -> "Adaptation":
        """With one more step: its inputs (INPUTS,), outputs as measured (OUTPUTS,), and which of PAIRS swung."""
        x, y = (inputs, outputs) if swing == 0 else (mirrored_inputs(inputs), mirrored_outputs(outputs))
        P, C = self.doubt, self.models.coefficients[0]
        Px = P @ x
        gain = Px / (config.forgetting + x @ Px)
        C = C + np.outer(y - C @ x, gain)
        P = (P - np.outer(gain, Px)) / config.forgetting
        P = 0.5 * (P + P.T)
        # What nothing is learned about for long must not be forgotten without end.
        most = np.trace(_first_doubt(config) / np.outer(1.0 / _SPREAD, 1.0 / _SPREAD))
        trace = np.trace(P / np.outer(1.0 / _SPREAD, 1.0 / _SPREAD))
        P = P * min(1.0, most / max(trace, 1e-12))
        return Adaptation(replace(self.models, coefficients=models_of_both_pairs(C)), P, self.steps + 1)


def _first_doubt(config: AdaptationConfig) -> np.ndarray:
    return config.doubt * np.diag(1.0 / _SPREAD**2)
