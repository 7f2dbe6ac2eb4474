"""The system that stands in for the whole perception with ground truth."""

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.regions.oracle_regions import (
    OracleRegionConfig,
    centers_of,
    nearby_regions,
    regions_from_terrain,
)
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.robot_state import RobotState


class OracleRegions(Stage):
    """Knows the regions of the terrain around the robot from ground truth.

    The visible faces of the terrain, cut into cells; see perception.regions.oracle_regions.

    .. pydrake_system::

        name: OracleRegions
        input_ports:
        - robot_state
        output_ports:
        - region_set

    - robot_state: abstract RobotState, frame W; regions around its base are put out.
    - region_set: abstract RegionSet, frame W, at ``config.rate`` (20 Hz) or on demand; a region keeps its id.
    """

    def __init__(
        self,
        terrain: Terrain,
        foot_radius: float,
        config: OracleRegionConfig | None = None,
        *,
        timings: StageTimings | None = None,
    ):
        """``foot_radius`` in [m]."""
        super().__init__("oracle_regions", config or OracleRegionConfig(), memory=RegionSet.empty(), timings=timings)
        self._regions = regions_from_terrain(terrain, foot_radius, self.config)
        self._centers = centers_of(self._regions)
        self.declare_input("robot_state", RobotState)
        self.declare_output("region_set", RegionSet)

    def update(self, inputs: Inputs, memory: RegionSet, time: float) -> RegionSet:
        """Selects the regions around the robot."""
        state = inputs.robot_state
        near = nearby_regions(self._regions, state.p_WB, self.config.radius, self._centers)
        return RegionSet(state.stamp, near)
