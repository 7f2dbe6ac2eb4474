"""The system around the region extraction."""

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.regions.region_extraction import RegionConfig, extract_regions
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import SuperpixelImage
from quadpips_drake.values.regions import RegionSet


class RegionExtractor(Stage):
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
    - region_set: abstract RegionSet, frame W, computed when read (the superpixels set the rate) or at ``config.rate``;
      empty when there is no ground to step on.
    """

    WORTH_A_THREAD = True

    def __init__(self, foot_radius: float, config: RegionConfig | None = None, *, timings: StageTimings | None = None):
        """``foot_radius`` in [m]."""
        config = config or RegionConfig()
        super().__init__("region_extractor", config, memory=RegionSet.empty(), label="regions", timings=timings)
        self._foot_radius = float(foot_radius)
        self.declare_input("superpixels", SuperpixelImage)
        self.declare_output("region_set", RegionSet)

    def update(self, inputs: Inputs, memory: RegionSet, time: float) -> RegionSet:
        """Extracts the regions of this moment."""
        return extract_regions(inputs.superpixels, self._foot_radius, self.config)
