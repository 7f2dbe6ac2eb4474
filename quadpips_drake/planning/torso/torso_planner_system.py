"""TorsoPlanner: the torso search as a Drake system."""

from contextlib import nullcontext
from dataclasses import dataclass

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.planning.start_stance import attach_feet, start_ground, with_region
from quadpips_drake.planning.torso.torso_search import TorsoConfig, search_torso_path
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import PlanRequest, TorsoPath
from quadpips_drake.values.regions import PlanarRegion, RegionSet
from quadpips_drake.values.robot_state import RobotState


@dataclass(frozen=True, eq=False)
class _Memory(ImmutableValue):
    """The last path, and the ground that the robot stood on at the first request."""

    path: TorsoPath
    ground: PlanarRegion | None = None


class TorsoPlanner(LeafSystem):
    """Plans a path of the torso over the perceived regions, once for each new request (QuadPiPS section VI-B).

    A* over regions times yaws; see ``search_torso_path``. The ground that a front camera cannot see because the robot stands
    on it is assumed at the first request, from the feet, if there is none in the regions (``assume_start_ground``).

    .. pydrake_system::

        name: TorsoPlanner
        input_ports:
        - robot_state
        - region_set
        - plan_request
        output_ports:
        - torso_path

    - robot_state: RobotState, frame W.
    - region_set: RegionSet, frame W; empty before anything was seen.
    - plan_request: PlanRequest; a new ``id`` asks for a path, 0 for nothing.
    - torso_path: TorsoPath, frame W, of the last request, with the regions that were searched; it has no poses and a reason
      when nothing was found. Looks for a new request at 1 / ``period`` (30 Hz).
    """

    def __init__(
        self, robot, config: TorsoConfig | None = None, *, period: float = 1 / 30, timings: StageTimings | None = None
    ):
        super().__init__()
        self.set_name("torso_planner")
        self._robot = robot
        self._config = config or TorsoConfig()
        self._timings = timings
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        self._region_set = self.DeclareAbstractInputPort("region_set", AbstractValue.Make(RegionSet.empty()))
        self._request = self.DeclareAbstractInputPort("plan_request", AbstractValue.Make(PlanRequest.empty()))
        self._memory = self.DeclareAbstractState(AbstractValue.Make(_Memory(TorsoPath.empty())))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self.DeclareAbstractOutputPort(
            "torso_path",
            lambda: AbstractValue.Make(TorsoPath.empty()),
            lambda context, output: output.set_value(self._read(context).path),
            {self.abstract_state_ticket(self._memory)},
        )

    def _read(self, context) -> _Memory:
        return context.get_abstract_state(int(self._memory)).get_value()

    def _update(self, context, state):
        request, memory = self._request.Eval(context), self._read(context)
        if request.id in (0, memory.path.request_id):
            return
        robot_state, regions = self._robot_state.Eval(context), self._region_set.Eval(context)
        with self._timings.measure("torso_search") if self._timings else nullcontext():
            ground = memory.ground
            if self._config.assume_start_ground and memory.path.request_id == 0:
                ground = self._unseen_ground(robot_state, regions)
            path = search_torso_path(
                robot_state.p_WB,
                float(robot_state.rpy_WB[2]),
                with_region(regions, ground) if regions.regions else regions,  # nobody walks blindly
                request.goal,
                self._robot,
                self._config,
                request_id=request.id,
            )
        state.get_mutable_abstract_state(int(self._memory)).set_value(_Memory(path, ground))

    def _unseen_ground(self, robot_state, regions: RegionSet) -> PlanarRegion | None:
        """Returns the ground under the robot as a region unless a foot stands on a perceived one."""
        if any(attachment.perceived for attachment in attach_feet(robot_state, regions.regions, self._robot)):
            return None
        return start_ground(robot_state, self._robot, self._config.start_ground_margin)
