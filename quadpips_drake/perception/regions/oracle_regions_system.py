"""The system that stands in for the whole perception with ground truth."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.perception.periodic_stage import declare_periodic_output
from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig, nearby_regions, regions_from_terrain
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.robot_state import RobotState


class OracleRegions(LeafSystem):
    """Knows the regions of the terrain around the robot from ground truth.

    The visible faces of the terrain, cut into cells; see perception.regions.oracle_regions.

    .. pydrake_system::

        name: OracleRegions
        input_ports:
        - robot_state
        output_ports:
        - region_set

    - robot_state: abstract RobotState, frame W; regions around its base are put out.
    - region_set: abstract RegionSet, frame W, every ``config.period`` (20 Hz) or on demand; a region keeps its id.
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
        super().__init__()
        self._config = config or OracleRegionConfig()
        self._timings = timings or StageTimings()
        self._regions = regions_from_terrain(terrain, foot_radius, self._config)
        self._state_port = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        declare_periodic_output(
            self, "region_set", RegionSet(stamp=float("-inf")), self._select, [self._state_port], self._config.period
        )

    def _select(self, context) -> RegionSet:
        state = self._state_port.Eval(context)
        with self._timings.measure("oracle_regions"):
            return RegionSet(state.stamp, nearby_regions(self._regions, state.p_WB, self._config.radius))
