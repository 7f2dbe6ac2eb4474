"""ReplanMonitor: the state machine around the planner as a Drake system."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.errors import UserInputError
from quadpips_drake.supervision.replan_monitor import Monitor, MonitorConfig, Situation, advance
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import FootholdPlan, MonitorStatus, PlanRequest, StageStatus
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.safety_status import SafetyStatus


@dataclass(frozen=True, eq=False)
class _Memory(ImmutableValue):
    """What the system remembers: the monitor, and what it last told the world."""

    monitor: Monitor
    status: MonitorStatus


class ReplanMonitor(LeafSystem):
    """Asks for plans until the goal is reached, and aborts a reference when the robot becomes unstable.

    QuadPiPS section VII-A: a completed reference, or a robot that the safety monitor calls unstable, lead to a new plan; in
    the latter case the reference is dropped first and the robot comes to rest. Failed plans are asked for again with newer
    regions, a few times; see ``replan_monitor.advance``.

    .. pydrake_system::

        name: ReplanMonitor
        input_ports:
        - robot_state
        - reference
        - foothold_plan
        - trajectory_status (optional)
        - safety_status (optional)
        output_ports:
        - plan_request
        - status
        - abort

    - robot_state: RobotState, frame W.
    - reference: WholeBodyReference that is being followed, in absolute time, frame W; without samples (request id 0) while
      there is none.
    - foothold_plan: FootholdPlan, frame W; a failed one for the request ends it.
    - trajectory_status (optional): StageStatus of the swing optimiser; a failure for the request ends it.
    - safety_status (optional): SafetyStatus; while it is unstable there is nothing to follow. Missing: always stable.
    - plan_request: PlanRequest for the goal, frame W; a new id for each plan, 0 before the first.
    - status: MonitorStatus: phase, reason, counters and the distance to the goal [m].
    - abort: bool; True while the robot recovers, in which time there is nothing to follow.

    All outputs are updated at 1 / ``period`` (10 Hz).
    """

    def __init__(self, goal, config: MonitorConfig | None = None, *, period: float = 0.1):
        super().__init__()
        self.set_name("replan_monitor")
        self._goal = np.array(goal, dtype=float)
        if self._goal.shape != (2,) or not np.isfinite(self._goal).all():
            raise UserInputError(f"the goal must be two finite numbers x, y [m], not {goal}")
        self._config = config or MonitorConfig()
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        self._reference = self.DeclareAbstractInputPort("reference", AbstractValue.Make(WholeBodyReference.empty()))
        self._foothold_plan = self.DeclareAbstractInputPort("foothold_plan", AbstractValue.Make(FootholdPlan.empty()))
        self._trajectory_status = self.DeclareAbstractInputPort("trajectory_status", AbstractValue.Make(StageStatus.empty()))
        self._safety_status = self.DeclareAbstractInputPort("safety_status", AbstractValue.Make(SafetyStatus.empty()))
        first = Monitor(PlanRequest(0, 0.0, self._goal))
        self._memory = self.DeclareAbstractState(
            AbstractValue.Make(_Memory(first, MonitorStatus(0.0, first.phase, first.reason)))
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self._declare_output("plan_request", first.request, lambda memory: memory.monitor.request)
        self._declare_output("status", MonitorStatus(0.0, first.phase), lambda memory: memory.status)
        self._declare_output("abort", False, lambda memory: memory.monitor.phase == "recovering")

    def _declare_output(self, name: str, example, read):
        self.DeclareAbstractOutputPort(
            name,
            lambda: AbstractValue.Make(example),
            lambda context, output: output.set_value(read(context.get_abstract_state(int(self._memory)).get_value())),
            {self.abstract_state_ticket(self._memory)},
        )

    def _update(self, context, state):
        has_status = self._trajectory_status.HasValue(context)
        now = Situation(
            time=context.get_time(),
            state=self._robot_state.Eval(context),
            reference=self._reference.Eval(context),
            foothold_plan=self._foothold_plan.Eval(context),
            trajectory_status=self._trajectory_status.Eval(context) if has_status else StageStatus.empty(),
            goal=self._goal,
            safety=self._safety_status.Eval(context) if self._safety_status.HasValue(context) else SafetyStatus.empty(),
        )
        monitor = advance(context.get_abstract_state(int(self._memory)).get_value().monitor, now, self._config)
        status = MonitorStatus(
            stamp=now.time,
            phase=monitor.phase,
            reason=monitor.reason,
            replans=monitor.replans,
            aborts=monitor.aborts,
            failed_plans=monitor.failed_plans,
            distance_to_goal=now.distance_to_goal,
        )
        state.get_mutable_abstract_state(int(self._memory)).set_value(_Memory(monitor, status))
