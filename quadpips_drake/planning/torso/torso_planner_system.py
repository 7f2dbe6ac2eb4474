"""TorsoPlanner: the torso search as a Drake system."""

from dataclasses import dataclass, field, replace

import numpy as np

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.planning.appeared_ground import without_appeared
from quadpips_drake.planning.start_stance import attach_feet, flat_region, start_ground, state_at_start, with_region
from quadpips_drake.planning.torso.subgoals import Exploration
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import PlanRequest, TorsoPath
from quadpips_drake.values.regions import GroundHeights, PlanarRegion, RegionSet
from quadpips_drake.values.robot_state import RobotState


@dataclass(frozen=True, eq=False)
class _Memory(ImmutableValue):
    """The last path, the ground that the robot stood on at the first request, and what was tried since."""

    path: TorsoPath
    ground: PlanarRegion | None = None
    exploration: Exploration = field(default_factory=Exploration)


class TorsoPlanner(Stage):
    """Plans a path of the torso over the perceived regions, once for each new request (QuadPiPS section VI-B).

    A* over regions times yaws; see ``search_torso_path``. The ground that a front camera cannot see because the robot stands
    on it is assumed at the first request, from the feet, if there is none in the regions (``assume_start_ground``).

    .. pydrake_system::

        name: TorsoPlanner
        input_ports:
        - robot_state
        - region_set
        - plan_request
        - ground_heights (optional)
        output_ports:
        - torso_path

    - robot_state: RobotState, frame W; a plan begins there unless the request names another start.
    - region_set: RegionSet, frame W; empty before anything was seen. Those on what the request calls appeared are left out.
    - plan_request: PlanRequest; a new ``id`` asks for a path, 0 for nothing.
    - ground_heights (optional): GroundHeights, frame W, that the torso must not hit.
    - torso_path: TorsoPath, frame W, of the last request, with the regions that were searched; it has no poses and a reason
      when nothing was found. Looks for a new request at ``config.rate`` (30 Hz).
    """

    WORTH_A_THREAD = True

    def __init__(
        self,
        robot,
        config: TorsoConfig | None = None,
        *,
        every_label: bool = False,
        timings: StageTimings | None = None,
    ):
        """``every_label``: whether regions of every label are ground, not only those that are steppable or unknown."""
        config = config or TorsoConfig()
        super().__init__("torso_planner", config, memory=_Memory(TorsoPath.empty()), label="torso_search", timings=timings)
        self._robot, self._every_label = robot, every_label
        self.declare_input("robot_state", RobotState)
        self.declare_input("region_set", RegionSet)
        self.declare_input("plan_request", PlanRequest)
        self.declare_input("ground_heights", GroundHeights, default=GroundHeights.empty())
        self.declare_output("torso_path", TorsoPath, lambda memory: memory.path)
        self._warm_up()

    def _warm_up(self):
        """Loads the compiled code, so that the first search takes no longer than any other."""
        floor = RegionSet(0.0, (flat_region(0, np.zeros(3), 1.0, 0.6),))
        p_WB = np.array([0.0, 0.0, self._robot.nominal_base_height])
        known = GroundHeights(0.0, np.zeros(2), 0.1, np.zeros((5, 5), np.float32))
        for distance in (0.3, 9.0):  # to the goal, and to a sub-goal instead
            search_torso_path(p_WB, 0.0, floor, np.array([distance, 0.0]), self._robot, self.config, heights=known)

    def occasion(self, inputs: Inputs) -> int | None:
        """A new request."""
        return inputs.plan_request.id or None

    def update(self, inputs: Inputs, memory: _Memory, time: float) -> _Memory:
        """Plans as requested."""
        request = inputs.plan_request
        state = state_at_start(inputs.robot_state, request.start)
        regions = without_appeared(inputs.region_set, request.appeared, request.keep_off)
        ground = memory.ground
        if self.config.assume_start_ground and memory.path.request_id == 0:
            ground = self._unseen_ground(state, regions)
        pose = (*state.p_WB[:2], float(state.rpy_WB[2]))
        failed = request.level > memory.path.level  # the level rises with each failure
        exploration = memory.exploration.standing_at(pose, request.goal, memory.path.poses if failed else None)
        path = search_torso_path(
            state.p_WB,
            float(state.rpy_WB[2]),
            with_region(regions, ground) if regions.regions else regions,  # nobody walks blindly
            request.goal,
            self._robot,
            self.config,
            request_id=request.id,
            level=request.level,
            exploration=exploration,
            every_label=self._every_label,
            heights=inputs.ground_heights,
        )
        return _Memory(replace(path, start=request.start, appeared=request.appeared), ground, exploration.after(path))

    def _unseen_ground(self, robot_state, regions: RegionSet) -> PlanarRegion | None:
        """Returns the ground under the robot as a region unless a foot stands on a perceived one."""
        if any(attachment.perceived for attachment in attach_feet(robot_state, regions.regions, self._robot)):
            return None
        return start_ground(robot_state, self._robot, self.config.start_ground_margin)
