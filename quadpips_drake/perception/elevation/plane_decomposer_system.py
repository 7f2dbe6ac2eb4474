"""The system around the plane decomposition."""

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.elevation.elevation_config import FINE, PlaneConfig, with_preset
from quadpips_drake.perception.elevation.plane_decomposition import PlaneRegions, decompose_planes
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.regions import ElevationMap, RegionSet


class PlaneDecomposer(Stage):
    """Takes an elevation map apart into planar convex regions that may carry a foot.

    Inpainting, median, planarity, connected components, RANSAC, contours, insets (R. Grandia et al., T-RO 2023, section
    III); see perception.elevation.plane_decomposition.

    .. pydrake_system::

        name: PlaneDecomposer
        input_ports:
        - elevation_map
        output_ports:
        - region_set

    - elevation_map: abstract ElevationMap, frame W.
    - region_set: abstract RegionSet, frame W, at ``config.rate`` (20 Hz) or on demand; empty when nothing is known. The
      labels of all regions are UNKNOWN: a map of heights knows geometry alone.
    """

    WORTH_A_THREAD = True

    def __init__(
        self,
        foot_radius: float,
        config: PlaneConfig | None = None,
        *,
        preset: str = FINE,
        timings: StageTimings | None = None,
    ):
        """``foot_radius`` in [m]; ``preset``: what null stands for in ``config``."""
        config = config or PlaneConfig()
        super().__init__("plane_decomposer", config, memory=PlaneRegions(), label="elevation_planes", timings=timings)
        self._foot_radius, self._filled = float(foot_radius), with_preset(config, preset)
        self.declare_input("elevation_map", ElevationMap)
        self.declare_output("region_set", RegionSet, lambda memory: memory.regions)

    def update(self, inputs: Inputs, memory: PlaneRegions, time: float) -> PlaneRegions:
        """Takes the map of this moment apart."""
        return decompose_planes(inputs.elevation_map, self._foot_radius, self._filled, memory)
