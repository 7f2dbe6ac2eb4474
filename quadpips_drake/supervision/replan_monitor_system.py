"""ReplanMonitor: the state machine around the planner as a Drake system."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.supervision.ground_events import extent_of, find_problems
from quadpips_drake.supervision.replan_monitor import Monitor, MonitorConfig, Situation, advance
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import FootholdPlan, PlanRequest, RefusedSwings
from quadpips_drake.values.reference import ReferenceCut, WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import PlannerPhase, PlannerStatus, SafetyStatus, StageStatus


@dataclass(frozen=True, eq=False)
class _Memory(ImmutableValue):
    """What the system remembers: the monitor, and what it last told the world."""

    monitor: Monitor
    status: PlannerStatus


class ReplanMonitor(Stage):
    """Asks for plans until the goal is reached, and aborts a reference when the robot becomes unstable.

    QuadPiPS section VII-A: a completed reference, or a robot that the safety monitor calls unstable, lead to a new plan; in
    the latter case the reference is dropped first and the robot comes to rest. Failed plans are asked for again with newer
    regions, a few times; see ``replan_monitor.advance``.

    .. pydrake_system::

        name: ReplanMonitor
        input_ports:
        - robot_state
        - goal
        - reference
        - foothold_plan
        - trajectory_status (optional)
        - refused_swings (optional)
        - safety_status (optional)
        - region_set (optional)
        - ground_heights (optional)
        output_ports:
        - plan_request
        - swings_to_avoid
        - status
        - abort
        - cut

    - robot_state: RobotState, frame W.
    - goal: x, y in W [m], vector (2,); it may move: the next request is for where it is then.
    - reference: WholeBodyReference that is being followed, in absolute time, frame W; without samples (request id 0) while
      there is none.
    - foothold_plan: FootholdPlan, frame W; a failed one for the request ends it.
    - trajectory_status (optional): StageStatus of the swing optimiser; a failure for the request ends it.
    - refused_swings (optional): RefusedSwings of the swing optimiser, frame W; if that leaves no reference, a plan without
      them is asked for at once.
    - safety_status (optional): SafetyStatus; while it is unstable there is nothing to follow. Missing: always stable and at
      rest.
    - region_set (optional): RegionSet, frame W, and
    - ground_heights (optional): GroundHeights, frame W: what is known now, against which the coming footholds, swings and
      the way of the torso are held (``ground_events``). Missing: nothing speaks against them.
    - plan_request: PlanRequest for the goal, frame W; a new id for each plan, 0 before the first.
    - swings_to_avoid: RefusedSwings that plans shall do without from here on, frame W.
    - status: PlannerStatus: phase, reason, counters and the distance to the goal [m].
    - abort: bool; True while the robot recovers, in which time there is nothing to follow.
    - cut: ReferenceCut: where the reference that is followed has to end, because it must not go on as planned.

    All outputs are updated at ``config.rate`` (10 Hz).
    """

    def __init__(
        self,
        robot: RobotModel,
        config: MonitorConfig | None = None,
        *,
        every_label: bool = False,
        timings: StageTimings | None = None,
    ):
        """``every_label``: whether no foothold is lost because of a label."""
        first = Monitor(PlanRequest(0, 0.0, np.zeros(2)))
        memory = _Memory(first, PlannerStatus(0.0, PlannerPhase(first.phase), first.reason))
        super().__init__("replan_monitor", config or MonitorConfig(), memory=memory, timings=timings)
        self._robot, self._every_label = robot, every_label
        self.declare_input("robot_state", RobotState)
        self.declare_vector_input("goal", 2)
        self.declare_input("reference", WholeBodyReference)
        self.declare_input("foothold_plan", FootholdPlan)
        self.declare_input("trajectory_status", StageStatus, default=StageStatus.empty())
        self.declare_input("refused_swings", RefusedSwings, default=RefusedSwings.empty())
        self.declare_input("safety_status", SafetyStatus, default=SafetyStatus.empty())
        self.declare_input("region_set", RegionSet, default=RegionSet.empty())
        self.declare_input("ground_heights", GroundHeights, default=GroundHeights.empty())
        self.declare_output("plan_request", PlanRequest, lambda memory: memory.monitor.request)
        self.declare_output("swings_to_avoid", RefusedSwings, lambda memory: memory.monitor.refused)
        self.declare_output("status", PlannerStatus, lambda memory: memory.status)
        self.declare_output("abort", bool, lambda memory: memory.monitor.phase == PlannerPhase.RECOVERING)
        self.declare_output("cut", ReferenceCut, lambda memory: memory.monitor.cut)

    def update(self, inputs: Inputs, memory: _Memory, time: float) -> _Memory:
        """Looks at the situation."""
        if not inputs.robot_state.is_known:
            return memory
        now = Situation(
            time=time,
            state=inputs.robot_state,
            reference=inputs.reference,
            foothold_plan=inputs.foothold_plan,
            trajectory_status=inputs.trajectory_status,
            goal=np.array(inputs.goal),
            safety=inputs.safety_status,
            refused=inputs.refused_swings,
            problems=self._problems(inputs, memory.monitor, time),
            regions_stamp=inputs.region_set.stamp,
            ground=inputs.ground_heights,
        )
        monitor = advance(memory.monitor, now, self.config)
        status = PlannerStatus(
            stamp=now.time,
            phase=PlannerPhase(monitor.phase),
            reason=monitor.reason,
            replans=monitor.replans,
            fallbacks={
                "failed_plans": monitor.failed_plans,
                "aborted_references": monitor.aborts,
                "late_plans": monitor.late_plans,
                "escalated_plans": monitor.escalated,
                "swing_trajectory": now.trajectory_status.fallbacks,
            },
            events=dict(monitor.events),
            distance_to_goal=now.distance_to_goal,
            escalation=monitor.request.level,
        )
        return _Memory(monitor, status)

    def _problems(self, inputs: Inputs, monitor: Monitor, time: float) -> tuple:
        """What newer knowledge of the ground says against the reference; only looked for while it matters."""
        config, regions = self.config.ground, inputs.region_set
        if monitor.phase != PlannerPhase.WALKING or not config.region_sets or regions.stamp <= monitor.doubts.stamp:
            return ()
        feet = self._robot.foot_positions_W(inputs.robot_state)
        extent = extent_of(self._robot)
        now, before = inputs.ground_heights, monitor.ground_then[0]
        known = regions, now, before, feet, extent, config, self._every_label, monitor.appeared
        return tuple(find_problems(inputs.reference, time, *known))
