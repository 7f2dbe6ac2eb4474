"""How well the models predict each first step of a plan: sums over a walk."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.baselines.motion_models.state import BASE_SHIFT, FEET_SHIFT, NEXT_VELOCITY, OUTPUTS
from quadpips_drake.values.immutable import ImmutableValue

_PARTS = {"cdm": BASE_SHIFT, "fdm": FEET_SHIFT, "cvm": NEXT_VELOCITY}


@dataclass(frozen=True, eq=False)
class PredictionErrors(ImmutableValue):
    """Of the outputs of the models, measured less predicted."""

    count: int = 0
    """Steps."""
    sums: np.ndarray = field(default_factory=lambda: np.zeros(OUTPUTS))
    """Of the errors with their signs, (OUTPUTS,)."""
    absolute: np.ndarray = field(default_factory=lambda: np.zeros(OUTPUTS))
    """Of their sizes, (OUTPUTS,)."""

    def with_step(self, predicted: np.ndarray, measured: np.ndarray) -> "PredictionErrors":
        """These and another step, (OUTPUTS,) each."""
        error = measured - predicted
        return PredictionErrors(self.count + 1, self.sums + error, self.absolute + np.abs(error))

    def plain(self) -> dict:
        """By model, in m and m/s: ``mae``, the true mean absolute error, ``mean``, that of the signed ones, both along x as
        in the paper, and ``mae_y``; those of the FDM over both swing feet. And ``steps``, how many."""
        if self.count == 0:
            return {"steps": 0}
        told = {"steps": self.count}
        for name, part in _PARTS.items():
            absolute, signed = (
                values[part].reshape(-1, 2).mean(axis=0) / self.count for values in (self.absolute, self.sums)
            )
            told[name] = {
                "mae": round(float(absolute[0]), 5),
                "mean": round(float(signed[0]), 5),
                "mae_y": round(float(absolute[1]), 5),
            }
        return told
