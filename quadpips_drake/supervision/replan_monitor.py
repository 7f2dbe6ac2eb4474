"""When to plan, when to stop, when to give up: the state machine around the planner (QuadPiPS section VII-A)."""

from dataclasses import dataclass, field, replace

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import FootholdPlan, PlanRequest
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import SafetyStatus, StageStatus

_PUBLICATION_TIME = 0.05
"""How long after its status a reference is published at the latest [s]."""


@configuration
class MonitorConfig(StageConfig):
    """When the monitor reacts. What counts as unstable or at rest is decided by the safety monitor of the control stage."""

    rate: float = stage_rate(10.0)
    """How often it looks at everything [Hz] (the authors' release: 10)."""

    goal_tolerance: float = ranged(0.20, 0.001, 100.0)
    """The goal is reached when the base is this close to it, in xy [m]."""
    goal_lost: float = ranged(0.30, 0.001, 100.0)
    """A robot that was at the goal sets out again when it is further away than this [m]."""
    stand_up_time: float = ranged(0.5, 0.0, 1000.0)
    """Least time for standing up at the start [s]."""
    stand_up_timeout: float = ranged(4.0, 0.0, 1000.0)
    """Time after which standing up counts as done even if the robot still moves [s]."""
    pause: float = ranged(0.2, 0.0, 1000.0)
    """Time at rest between a completed reference and the next request [s] (0.5 in the release)."""
    retry_pause: float = ranged(0.5, 0.0, 1000.0)
    """Time between a failed plan and the next request, for newer regions [s]."""
    planning_timeout: float = ranged(3.0, 0.0, 1000.0)
    """A request without a reference for this long has failed [s]."""
    max_failed_plans: int = ranged(5, 1, 1_000_000)
    """As many failures in a row end in no_plan."""
    near_end: float = ranged(0.15, 0.0, 100.0)
    """A reference is completed when the base is this close to its last position [m] and its time is over."""
    completion_timeout: float = ranged(1.0, 0.0, 1000.0)
    """... or this long after its time is over [s], wherever the base is."""

    def __post_init__(self):
        super().__post_init__()
        if self.goal_tolerance > self.goal_lost:
            raise UserInputError(
                f"goal_tolerance must be at most goal_lost, {self.goal_lost:g} m, is {self.goal_tolerance:g}"
            )


@dataclass(frozen=True, eq=False)
class Situation:
    """Everything that the monitor looks at."""

    time: float
    state: RobotState
    reference: WholeBodyReference
    foothold_plan: FootholdPlan
    trajectory_status: StageStatus
    goal: np.ndarray
    safety: SafetyStatus = field(default_factory=SafetyStatus.empty)

    @property
    def distance_to_goal(self) -> float:
        """Of the base, in xy [m]."""
        return float(np.hypot(*(self.state.p_WB[:2] - self.goal)))


@dataclass(frozen=True, eq=False)
class Monitor(ImmutableValue):
    """The monitor's memory."""

    request: PlanRequest
    phase: str = "standing_up"
    reason: str = "standing up"
    since: float = 0.0
    """When the phase began [s]."""
    wait: float = 0.0
    """How long a pause lasts [s]."""
    failing_since: float = np.inf
    """Since when the trajectory stage has reported a failure of this request [s]; inf while it has not."""
    replans: int = 0
    aborts: int = 0
    failed_plans: int = 0
    failed_in_a_row: int = 0
    level: int = 0
    """How hard the next plan is tried: more after each failure and instability, less after each reference."""
    escalated: int = 0
    """Requests above level 0."""


def _enter(monitor: Monitor, phase: str, time: float, reason: str = "", **changes) -> Monitor:
    return replace(monitor, phase=phase, since=time, reason=reason, **changes)


def advance(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    """Returns the monitor's memory after looking at the situation ``now``."""
    if now.safety.unstable and monitor.phase in ("pausing", "planning", "walking", "goal_reached"):
        level = max(monitor.level, 1)  # more carefully from here on
        return _enter(monitor, "recovering", now.time, now.safety.reason, aborts=monitor.aborts + 1, level=level)
    return _STEPS[monitor.phase](monitor, now, config)


def _standing_up(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    lasted = now.time - monitor.since
    if lasted >= config.stand_up_timeout or (lasted >= config.stand_up_time and now.safety.at_rest):
        return _pause(monitor, now, 0.0, "the robot stands", config)
    return monitor


def _pause(monitor: Monitor, now: Situation, wait: float, reason: str, config: MonitorConfig) -> Monitor:
    """Rests before the next request; unless there is no need for one."""
    if now.distance_to_goal <= config.goal_tolerance:
        return _enter(monitor, "goal_reached", now.time, f"the base is {now.distance_to_goal:.2f} m from the goal")
    return _enter(monitor, "pausing", now.time, reason, wait=wait)


def _pausing(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    if now.time - monitor.since < monitor.wait - 1e-9:
        return monitor
    request = PlanRequest(monitor.request.id + 1, now.time, now.goal, monitor.level)
    counts = {"replans": monitor.replans + (monitor.request.id > 0), "escalated": monitor.escalated + (monitor.level > 0)}
    return _enter(monitor, "planning", now.time, monitor.reason, request=request, failing_since=np.inf, **counts)


def _planning(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    asked = monitor.request.id
    if now.reference.request_id == asked and len(now.reference.times):
        plan = now.foothold_plan
        reason = f"{len(plan.swing_legs)} swings" if plan.request_id == asked else "a new reference"
        return _enter(monitor, "walking", now.time, reason, failed_in_a_row=0, level=max(monitor.level - 1, 0))
    if now.foothold_plan.request_id == asked and not now.foothold_plan.success:
        return _fail(monitor, now, now.foothold_plan.reason, config)
    if now.trajectory_status.request_id == asked and not now.trajectory_status.ok:
        # That may also mean that the reference is shorter than the plan; then it is published in a moment.
        if now.time - monitor.failing_since >= _PUBLICATION_TIME:
            return _fail(monitor, now, now.trajectory_status.reason, config)
        monitor = replace(monitor, failing_since=min(monitor.failing_since, now.time))
    if now.time - monitor.since >= config.planning_timeout:
        return _fail(monitor, now, f"no reference came within {config.planning_timeout:g} s", config)
    return monitor


def _fail(monitor: Monitor, now: Situation, reason: str, config: MonitorConfig) -> Monitor:
    in_a_row = monitor.failed_in_a_row + 1
    level = max(monitor.level + 1, in_a_row)
    monitor = replace(monitor, failed_in_a_row=in_a_row, failed_plans=monitor.failed_plans + 1, level=level)
    if in_a_row >= config.max_failed_plans:
        return _enter(monitor, "no_plan", now.time, f"{in_a_row} plans in a row failed: {reason}")
    return _pause(monitor, now, config.retry_pause, f"the plan failed: {reason}", config)


def _walking(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    reference = now.reference
    if reference.request_id != monitor.request.id or not len(reference.times):
        return _pause(monitor, now, config.pause, "the reference was dropped", config)
    late = now.time - float(reference.times[-1])
    distance = float(np.linalg.norm(now.state.p_WB - reference.states[-1, CentroidalState.POSITION]))
    if late >= 0.0 and distance <= config.near_end:
        return _pause(monitor, now, config.pause, "the reference is completed", config)
    if late >= config.completion_timeout:
        return _pause(monitor, now, config.pause, f"the reference ended {distance:.2f} m away", config)
    return monitor


def _recovering(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    if now.safety.unstable:
        return monitor
    return _pause(monitor, now, 0.0, f"recovered after: {monitor.reason}", config)


def _goal_reached(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    if now.distance_to_goal > config.goal_lost:
        return _pause(monitor, now, config.pause, "the goal was lost", config)
    return monitor


def _no_plan(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    return monitor


_STEPS = {
    "standing_up": _standing_up,
    "pausing": _pausing,
    "planning": _planning,
    "walking": _walking,
    "recovering": _recovering,
    "goal_reached": _goal_reached,
    "no_plan": _no_plan,
}
