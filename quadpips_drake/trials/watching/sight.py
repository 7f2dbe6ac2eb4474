"""What a robot sees, as columns of the log."""

import numpy as np

from quadpips_drake.framework.ports import output_names
from quadpips_drake.trials.observation import read
from quadpips_drake.values.steppability import Steppability


class Sight:
    """Counts what perception puts out; what has been counted already is not counted again."""

    def __init__(self, regions):
        """``regions``: the system that puts out the regions."""
        self._system = regions
        self._has_can = "egocan" in output_names(regions)
        self._regions, self._labels = None, np.zeros(len(Steppability), np.int16)
        self._can, self._measured = None, np.nan

    def row(self, diagram, context) -> dict[str, np.ndarray]:
        """Columns of one sample.

        Returns: ``region_labels``, how many of the regions have each label of Steppability; ``regions_stamp``, when the
            newest image behind them was taken [s]; ``measured``, the part of the cylinder of the egocan that anything was
            ever measured in [1], NaN without a camera.
        """
        regions = read(diagram, "region_set", context)
        if regions is not self._regions:
            labels = [region.label for region in regions.regions]
            self._regions, self._labels = regions, np.bincount(labels, minlength=len(Steppability)).astype(np.int16)
        if self._has_can:
            can = self._system.GetOutputPort("egocan").Eval(self._system.GetMyContextFromRoot(context))
            if can is not self._can:
                points = can.cylinder_points_W
                self._can, self._measured = can, float(np.isfinite(points[..., 2]).mean()) if points.size else 0.0
        return {"region_labels": self._labels, "regions_stamp": regions.stamp, "measured": self._measured}
