"""The system around the region extraction."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.perception.periodic_stage import declare_periodic_output
from quadpips_drake.perception.regions.region_extraction import RegionConfig, extract_regions
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import SuperpixelImage
from quadpips_drake.values.regions import RegionSet


class RegionExtractor(LeafSystem):
    """Turns superpixels into planar convex regions that may carry a foot.

    Convex hulls, carved so that they hold nothing but seen ground, and inset by the foot's radius and a margin; QuadPiPS
    section V-E; see perception.regions.region_extraction.

    .. pydrake_system::

        name: RegionExtractor
        input_ports:
        - superpixels
        output_ports:
        - region_set

    - superpixels: abstract SuperpixelImage, frame E.
    - region_set: abstract RegionSet, frame W, computed when read (the superpixels set the rate) or every ``config.period``;
      empty when there is no ground to step on.
    """

    def __init__(self, foot_radius: float, config: RegionConfig | None = None, *, timings: StageTimings | None = None):
        """``foot_radius`` in [m]."""
        super().__init__()
        self._foot_radius = float(foot_radius)
        self._config = config or RegionConfig()
        self._timings = timings or StageTimings()
        self._superpixel_port = self.DeclareAbstractInputPort("superpixels", AbstractValue.Make(SuperpixelImage.empty()))
        declare_periodic_output(
            self, "region_set", RegionSet(stamp=float("-inf")), self._extract, [self._superpixel_port], self._config.period
        )

    def _extract(self, context) -> RegionSet:
        superpixels = self._superpixel_port.Eval(context)
        with self._timings.measure("regions"):
            return extract_regions(superpixels, self._foot_radius, self._config)
