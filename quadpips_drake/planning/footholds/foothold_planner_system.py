"""FootholdPlanner: the foothold search as a Drake system."""

from contextlib import nullcontext

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.plans import FootholdPlan, TorsoPath
from quadpips_drake.values.robot_state import RobotState


class FootholdPlanner(LeafSystem):
    """Plans the footholds along a torso path, once for each new path (QuadPiPS section VI-C).

    A* over contact-mode families; see ``search_footholds``. It steps on the regions that the torso search used, which come
    with the path, so that both plan in the same world.

    .. pydrake_system::

        name: FootholdPlanner
        input_ports:
        - robot_state
        - torso_path
        output_ports:
        - foothold_plan

    - robot_state: RobotState, frame W.
    - torso_path: TorsoPath, frame W, with its regions; a new ``request_id`` asks for a plan, 0 for nothing. If it failed,
      the plan fails with the same reason.
    - foothold_plan: FootholdPlan, frame W, for the last path; it has no stances and a reason when nothing was found. Looks
      for a new path at 1 / ``period`` (15 Hz).
    """

    def __init__(
        self, robot, config: FootholdConfig | None = None, *, period: float = 1 / 15, timings: StageTimings | None = None
    ):
        super().__init__()
        self.set_name("foothold_planner")
        self._robot = robot
        self._config = config or FootholdConfig()
        self._timings = timings
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        self._torso_path = self.DeclareAbstractInputPort("torso_path", AbstractValue.Make(TorsoPath.empty()))
        self._plan = self.DeclareAbstractState(AbstractValue.Make(FootholdPlan.empty()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self.DeclareStateOutputPort("foothold_plan", self._plan)

    def _update(self, context, state):
        path = self._torso_path.Eval(context)
        if path.request_id in (0, context.get_abstract_state(int(self._plan)).get_value().request_id):
            return
        with self._timings.measure("foothold_search") if self._timings else nullcontext():
            plan = search_footholds(self._robot_state.Eval(context), path.regions, path, self._robot, self._config)
        state.get_mutable_abstract_state(int(self._plan)).set_value(plan)
