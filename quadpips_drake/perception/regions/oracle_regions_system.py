"""The system that stands in for the whole perception with ground truth."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.regions.oracle_regions import (
    OracleRegionConfig,
    centers_of,
    nearby_regions,
    regions_from_terrain,
)
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.robot_state import RobotState

_CELL, _REACH = 0.02, 1.5
"""Cells of the heights, and how far from the base they reach along x and y [m]."""


@dataclass(frozen=True, eq=False)
class _Seen(ImmutableValue):
    """The regions around the robot, and where that is."""

    regions: RegionSet
    p_WB: np.ndarray


class OracleRegions(Stage):
    """Knows the regions of the terrain around the robot, and its heights, from ground truth.

    The visible faces of the terrain, cut into cells; see perception.regions.oracle_regions.

    .. pydrake_system::

        name: OracleRegions
        input_ports:
        - robot_state
        output_ports:
        - region_set
        - ground_heights

    - robot_state: abstract RobotState, frame W; regions around its base are put out.
    - region_set: abstract RegionSet, frame W, at ``config.rate`` (20 Hz) or on demand; a region keeps its id.
    - ground_heights: GroundHeights, frame W, exact in the middle of each cell; computed when it is read.
    """

    def __init__(
        self,
        terrain: Terrain,
        foot_radius: float,
        config: OracleRegionConfig | None = None,
        *,
        every_label: bool = False,
        timings: StageTimings | None = None,
    ):
        """``foot_radius`` in [m]; ``every_label``: whether there are regions on what is not steppable, too."""
        nothing = _Seen(RegionSet.empty(), np.full(3, np.nan))
        super().__init__("oracle_regions", config or OracleRegionConfig(), memory=nothing, timings=timings)
        self._truth = GroundTruth(terrain)
        self._regions = regions_from_terrain(terrain, foot_radius, self.config, every_label)
        self._centers = centers_of(self._regions)
        self.declare_input("robot_state", RobotState)
        self.declare_output("region_set", RegionSet, lambda memory: memory.regions)
        self.declare_output("ground_heights", GroundHeights, self._heights)

    def update(self, inputs: Inputs, memory: _Seen, time: float) -> _Seen:
        """Selects the regions around the robot."""
        state = inputs.robot_state
        near = nearby_regions(self._regions, state.p_WB, self.config.radius, self._centers)
        return _Seen(RegionSet(state.stamp, near), state.p_WB)

    def _heights(self, memory: _Seen) -> GroundHeights:
        if not np.isfinite(memory.p_WB).all():
            return GroundHeights.empty()
        first, count = np.floor((memory.p_WB[:2] - _REACH) / _CELL), round(2.0 * _REACH / _CELL)
        x, y = (_CELL * (first[:, None] + np.arange(count) + 0.5))[..., None]
        heights = self._truth.height(x, y.T)
        return GroundHeights(memory.regions.stamp, first * _CELL, _CELL, heights.astype(np.float32))
