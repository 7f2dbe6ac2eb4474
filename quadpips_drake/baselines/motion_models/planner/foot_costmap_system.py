"""The systems that put out where feet may come down: from what was seen, and from the truth."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.baselines.motion_models.planner.foot_costmap import (
    FootCostmap,
    FootCostmapConfig,
    exact_costmap,
    foot_costmap,
)
from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.framework.stage_config import OnDemandStageConfig, StageConfig
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.regions import GroundHeights
from quadpips_drake.values.robot_state import RobotState

_ORACLE_RATE = 20.0
"""How often the exact map is looked after [Hz]."""
_MOVED = 0.25
"""It is made anew when the base has gone so far from its middle [m]."""


class FootCostmapBuilder(Stage):
    """Tells where feet may come down from the ground that perception remembers; see ``foot_costmap``.

    .. pydrake_system::

        name: FootCostmapBuilder
        input_ports:
        - ground_heights
        output_ports:
        - foot_costmap

    - ground_heights: GroundHeights, frame W.
    - foot_costmap: FootCostmap, frame W, with the stamp of the heights; without cells while there are none. Computed when it
      is read.
    """

    def __init__(self, config: FootCostmapConfig | None = None, *, timings: StageTimings | None = None):
        super().__init__("foot_costmap", OnDemandStageConfig(), memory=FootCostmap.empty(), timings=timings)
        self._costmap = config or FootCostmapConfig()
        self.declare_input("ground_heights", GroundHeights)
        self.declare_output("foot_costmap", FootCostmap)

    def update(self, inputs: Inputs, memory: FootCostmap, time: float) -> FootCostmap:
        """The map of the present heights."""
        return foot_costmap(inputs.ground_heights, self._costmap)


@dataclass(frozen=True, eq=False)
class _Around(ImmutableValue):
    """The map, and around where it was made."""

    costmap: FootCostmap
    center: np.ndarray


class OracleFootCostmap(Stage):
    """Tells where feet may come down from the true terrain, around the robot.

    .. pydrake_system::

        name: OracleFootCostmap
        input_ports:
        - robot_state
        output_ports:
        - foot_costmap

    - robot_state: RobotState, frame W.
    - foot_costmap: FootCostmap, frame W, exact in the middle of each cell; looked after at 20 Hz.
    """

    def __init__(self, terrain: Terrain, config: FootCostmapConfig | None = None, *, timings: StageTimings | None = None):
        super().__init__(
            "oracle_foot_costmap",
            StageConfig(rate=_ORACLE_RATE),
            memory=_Around(FootCostmap.empty(), np.full(2, np.nan)),
            label="foot_costmap",
            timings=timings,
            first=FirstUpdate.AT_INITIALIZATION,
        )
        self._truth, self._costmap = GroundTruth(terrain), config or FootCostmapConfig()
        self.declare_input("robot_state", RobotState)
        self.declare_output("foot_costmap", FootCostmap, lambda memory: memory.costmap)

    def update(self, inputs: Inputs, memory: _Around, time: float) -> _Around:
        """The map around the robot."""
        state = inputs.robot_state
        if not (state.is_known and np.isfinite(state.p_WB).all()):
            return memory
        moved = np.abs(state.p_WB[:2] - memory.center).max()
        if moved <= _MOVED:
            return replace(memory, costmap=replace(memory.costmap, stamp=state.stamp))
        center = state.p_WB[:2].copy()
        return _Around(exact_costmap(self._truth, state.stamp, center, self._costmap), center)
