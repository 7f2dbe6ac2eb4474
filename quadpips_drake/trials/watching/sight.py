"""What a robot sees, as columns of the log."""

import numpy as np

from quadpips_drake.framework.ports import output_names
from quadpips_drake.trials.observation import read
from quadpips_drake.values.steppability import Steppability

_PERIOD = 0.1
"""Between two looks [s]: whoever reads regions may be the one for whom they are computed. The replan monitor reads them then
anyway."""


class Sight:
    """Counts what perception puts out."""

    def __init__(self, regions):
        """``regions``: the system that puts out the regions."""
        self._system = regions
        self._has_can = "egocan" in output_names(regions)
        self._next = -np.inf
        self._seen: dict[str, np.ndarray] = {}

    def row(self, diagram, context) -> dict[str, np.ndarray]:
        """Columns of one sample.

        Returns: ``region_labels``, how many of the regions have each label of Steppability; ``regions_stamp``, when the
            newest image behind them was taken [s]; ``measured``, the part of the cylinder of the egocan in which anything
            was measured [1], NaN without a camera.
        """
        now = context.get_time()
        if now >= self._next - 1e-9:
            self._next, self._seen = now + _PERIOD, self._look(diagram, context)
        return self._seen

    def _look(self, diagram, context) -> dict[str, np.ndarray]:
        regions, measured = read(diagram, "region_set", context), np.nan
        if self._has_can:
            can = self._system.GetOutputPort("egocan").Eval(self._system.GetMyContextFromRoot(context))
            measured = float(np.isfinite(can.cylinder_points_W[..., 2]).mean()) if can.cylinder_points_W.size else 0.0
        labels = np.bincount([region.label for region in regions.regions], minlength=len(Steppability))
        return {"region_labels": labels.astype(np.int16), "regions_stamp": regions.stamp, "measured": measured}
