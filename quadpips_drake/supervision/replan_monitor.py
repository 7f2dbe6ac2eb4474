"""When to plan, when to stop, when to give up: the state machine around the planner (QuadPiPS section VII-A).

The next plan is made while the robot still walks: it begins where the present reference will lead, all feet down between two
swings, and is joined to it there. The robot stands to plan only when there is no next plan in time.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.planning.appeared_ground import with_hidden_side
from quadpips_drake.supervision.ground_events import Doubts, GroundEventConfig, appeared_ground, confirmed_problem
from quadpips_drake.supervision.plan_starts import PUBLICATION_TIME, last_stance, next_start
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import FootholdPlan, PlanRequest, PlanStart, RefusedSwings
from quadpips_drake.values.reference import ReferenceCut, WholeBodyReference
from quadpips_drake.values.regions import GroundHeights
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import SafetyStatus, StageStatus

_MORE_LEAD = 0.2
"""By how much the next plan is asked for earlier after one that came too late [s]."""
BETTER_VIEW = "better_view"
"""Event: a next plan that came to nothing is asked for again, with what has been seen since."""
_LEAST_LEAD = 0.5
"""A plan from where the reference has to end is asked for if there is this part of the lead time left [1]."""
_SURROUNDINGS = 1.5
"""Refused swings are forgotten when the robot is further than this from where they begin [m]."""


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
    max_refusals: int = ranged(8, 0, 1000)
    """How often in a row a plan whose first swing was refused is asked for again at once, without that swing; then it has
    failed [1]."""
    near_end: float = ranged(0.15, 0.0, 100.0)
    """A reference is completed when the base is this close to its last position [m] and its time is over."""
    completion_timeout: float = ranged(1.0, 0.0, 1000.0)
    """... or this long after its time is over [s], wherever the base is."""
    replaced_swings: int = ranged(2, 0, 20)
    """The next plan is made while the robot walks, and takes the place of this many last swings of the present one."""
    lead_time: float = ranged(0.9, 0.0, 100.0)
    """How long before the next plan begins it is asked for [s]; more after one that came too late. 0: the robot stands
    between plans, as in the release."""
    ground: GroundEventConfig = field(default_factory=GroundEventConfig)

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
    refused: RefusedSwings = field(default_factory=RefusedSwings.empty)
    """What the trajectory stage refused of the last plan."""
    problems: tuple = ()
    """Problems that the newest regions and heights make for the reference."""
    regions_stamp: float = -np.inf
    """Of these regions [s]."""
    ground: GroundHeights = field(default_factory=GroundHeights.empty)
    """The newest heights."""

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
    refused: RefusedSwings = field(default_factory=RefusedSwings.empty)
    """Swings that no plan shall have again, until the robot has moved on."""
    refusals_in_a_row: int = 0
    followed: int = 0
    """Request id of the reference that is being followed while walking; the last request may be for the next one."""
    last_one: bool = False
    """Whether a plan that was to continue the present reference failed or is late: then the robot walks to its end, and
    stands."""
    came_to_nothing: bool = False
    """Whether it failed; one that is late says nothing against what was asked for."""
    lead: float = 0.0
    """What MonitorConfig.lead_time has grown by [s]."""
    late_plans: int = 0
    """Plans that were ready after they were to begin."""
    doubts: Doubts = field(default_factory=Doubts)
    """Problems that are not certain yet."""
    cut: ReferenceCut = field(default_factory=ReferenceCut.empty)
    """Where the reference that is being followed has to end."""
    ground_then: tuple = (GroundHeights.empty(), GroundHeights.empty())
    """The heights when the plan that is followed was asked for, and the last one."""
    appeared: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Points of ground that has risen since [m], (n, 3), until the robot has moved on."""
    events: tuple = ()
    """((name, count), ...) of what called for another plan."""


def _going_on(monitor: Monitor) -> dict:
    """Changes of a monitor that sees the reference that it asked for."""
    fresh = {"failed_in_a_row": 0, "refusals_in_a_row": 0, "last_one": False, "came_to_nothing": False}
    return fresh | {"followed": monitor.request.id, "level": max(monitor.level - 1, 0)}


def _counted(monitor: Monitor, event: str) -> Monitor:
    """The monitor after one more ``event``."""
    events = dict(monitor.events)
    return replace(monitor, events=tuple((events | {event: events.get(event, 0) + 1}).items()))


def _on_new_ground(monitor: Monitor) -> Monitor:
    """The monitor that follows the last plan from now on."""
    return replace(monitor, ground_then=(monitor.ground_then[1],) * 2)


def _enter(monitor: Monitor, phase: str, time: float, reason: str = "", **changes) -> Monitor:
    return replace(monitor, phase=phase, since=time, reason=reason, **changes)


def advance(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    """Returns the monitor's memory after looking at the situation ``now``."""
    if now.safety.unstable and monitor.phase in ("pausing", "planning", "walking", "goal_reached"):
        level = max(monitor.level, 1)  # more carefully from here on
        return _enter(monitor, "recovering", now.time, now.safety.reason, aborts=monitor.aborts + 1, level=level)
    monitor = _with_refusals(monitor, now)
    return _STEPS[monitor.phase](monitor, now, config)


def _with_refusals(monitor: Monitor, now: Situation) -> Monitor:
    """Remembers what was refused of the present request, once."""
    new = now.refused.request_id == monitor.request.id > monitor.refused.request_id and now.refused.swings
    if not new:
        return monitor
    swings = (*monitor.refused.swings, *now.refused.swings)
    return replace(monitor, refused=replace(monitor.refused, request_id=now.refused.request_id, swings=swings))


def _near(refused: RefusedSwings, state: RobotState) -> RefusedSwings:
    """Those that begin about where the robot is."""
    centers = [(swing, swing.start[:, :2].mean(axis=0)) for swing in refused.swings]
    near = (swing for swing, center in centers if np.hypot(*(center - state.p_WB[:2])) < _SURROUNDINGS)
    return replace(refused, swings=tuple(near))


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
    return _enter(monitor, "planning", now.time, monitor.reason, **_asking(monitor, now, config))


def _asking(monitor: Monitor, now: Situation, config: MonitorConfig, start: PlanStart | None = None) -> dict:
    """Changes of the monitor that asks for a plan."""
    failed = monitor.failed_in_a_row or monitor.refusals_in_a_row or (start is None and monitor.came_to_nothing)
    keep_off = config.ground.keep_off_least if failed else config.ground.keep_off
    appeared = monitor.appeared[np.hypot(*(monitor.appeared[:, :2] - now.state.p_WB[:2]).T) < _SURROUNDINGS]
    return {
        "request": PlanRequest(
            monitor.request.id + 1,
            now.time,
            now.goal,
            start=start,
            level=monitor.level,
            appeared=appeared,
            keep_off=keep_off,
        ),
        "appeared": appeared,
        "ground_then": (monitor.ground_then[0], now.ground),
        "replans": monitor.replans + (monitor.request.id > 0),
        "escalated": monitor.escalated + (monitor.level > 0),
        "failing_since": np.inf,
        "refused": replace(_near(monitor.refused, now.state), appeared=appeared[: 0 if failed else None]),
    }


def _planning(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    asked = monitor.request.id
    if now.reference.request_id == asked and len(now.reference.times):
        plan = now.foothold_plan
        reason = f"{len(plan.swing_legs)} swings" if plan.request_id == asked else "a new reference"
        return _enter(_on_new_ground(monitor), "walking", now.time, reason, **_going_on(monitor))
    monitor, problem = _look_for_problem(monitor, now)
    if not problem and now.time - monitor.since >= config.planning_timeout:
        problem = f"no reference came within {config.planning_timeout:g} s"
    return _fail(monitor, now, problem, config) if problem else monitor


def _look_for_problem(monitor: Monitor, now: Situation) -> tuple[Monitor, str]:
    """Why there will be no reference for the last request; empty while there may be one."""
    asked = monitor.request.id
    if now.foothold_plan.request_id == asked and not now.foothold_plan.success:
        return monitor, now.foothold_plan.reason
    if now.trajectory_status.request_id == asked and not now.trajectory_status.ok:
        # That may also mean that the reference is shorter than the plan; then it is published in a moment.
        if now.time - monitor.failing_since >= PUBLICATION_TIME:
            return monitor, now.trajectory_status.reason
        return replace(monitor, failing_since=min(monitor.failing_since, now.time)), ""
    return monitor, ""


def _fail(monitor: Monitor, now: Situation, reason: str, config: MonitorConfig) -> Monitor:
    refused = now.refused.request_id == monitor.request.id and now.refused.swings
    if refused and monitor.refusals_in_a_row < config.max_refusals:
        monitor = replace(monitor, refusals_in_a_row=monitor.refusals_in_a_row + 1)
        return _pause(monitor, now, 0.0, f"refused: {reason}", config)
    in_a_row = monitor.failed_in_a_row + 1
    counts = {"failed_in_a_row": in_a_row, "failed_plans": monitor.failed_plans + 1, "refusals_in_a_row": 0}
    monitor = replace(monitor, level=max(monitor.level + 1, in_a_row), **counts)
    if in_a_row >= config.max_failed_plans:
        return _enter(monitor, "no_plan", now.time, f"{in_a_row} plans in a row failed: {reason}")
    return _pause(monitor, now, config.retry_pause, f"the plan failed: {reason}", config)


def _walking(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    reference = now.reference
    if reference.request_id not in (monitor.followed, monitor.request.id) or not len(reference.times):
        return _pause(monitor, now, config.pause, "the reference was dropped", config)
    monitor = _look_at_ground(monitor, now, config)
    monitor = _look_ahead(monitor, now, config)
    late = now.time - float(reference.times[-1])
    distance = float(np.linalg.norm(now.state.p_WB - reference.states[-1, CentroidalState.POSITION]))
    if late >= 0.0 and distance <= config.near_end:
        return _pause(monitor, now, config.pause, "the reference is completed", config)
    if late >= config.completion_timeout:
        return _pause(monitor, now, config.pause, f"the reference ended {distance:.2f} m away", config)
    return monitor


def _look_at_ground(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    """Ends the reference before what it must not do any more, and asks for a plan from there."""
    doubts, problem = confirmed_problem(monitor.doubts, now.problems, now.regions_stamp, config.ground)
    monitor = replace(monitor, doubts=doubts)
    stop = None if problem is None else last_stance(now.reference, problem.before, now.time)
    if stop is None or (_is_cut(monitor, now) and monitor.cut.time <= stop.time):
        return monitor
    reason = f"{problem.kind.replace('_', ' ')}: {problem.words}"
    monitor = replace(_counted(monitor, problem.kind), cut=ReferenceCut(stop.follows, stop.time), reason=reason)
    if problem.place is not None:
        before = monitor.ground_then[0]
        new = appeared_ground(before, now.ground, problem.place, config.ground.height_change)
        new = with_hidden_side(new, before, now.ground, float(now.state.rpy_WB[2]))
        monitor = replace(monitor, appeared=np.concatenate((monitor.appeared, new)))
    asked = monitor.request
    if asked.id != monitor.followed and not monitor.last_one and asked.start.time <= stop.time:
        return monitor  # the next plan begins before; it will be looked at when it is there
    if stop.time - now.time < _LEAST_LEAD * config.lead_time or config.lead_time == 0.0:
        return replace(monitor, last_one=True)
    return replace(monitor, last_one=False, came_to_nothing=False, **_asking(monitor, now, config, stop))


def _look_ahead(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    """Asks for the plan after the present one when it is time, and sees what becomes of it."""
    reference, asked = now.reference, monitor.request
    if reference.request_id == asked.id != monitor.followed:
        reason = f"{len(now.foothold_plan.swing_legs)} swings, joined"
        return replace(_on_new_ground(monitor), reason=reason, **_going_on(monitor))
    if monitor.last_one:
        return monitor
    if asked.id != monitor.followed:
        return _await_next(monitor, now, config)
    start = _start_ahead(monitor, now, config)
    if start is None or now.time < start.time - config.lead_time - monitor.lead:
        return monitor
    return replace(monitor, **_asking(monitor, now, config, start))


def _start_ahead(monitor: Monitor, now: Situation, config: MonitorConfig) -> PlanStart | None:
    """Where the next plan begins; None when there is no such moment in time, or when the reference leads to the goal."""
    end = now.reference.states[-1, CentroidalState.POSITION]
    if config.lead_time == 0.0 or np.hypot(*(end[:2] - now.goal)) <= config.goal_tolerance:
        return None
    earliest = now.time + config.lead_time + monitor.lead - 1.0 / config.rate
    return next_start(now.reference, earliest, config.replaced_swings)


def _await_next(monitor: Monitor, now: Situation, config: MonitorConfig) -> Monitor:
    """Looks what has become of the plan that was asked for ahead."""
    monitor, problem = _look_for_problem(monitor, now)
    if problem:
        monitor = replace(monitor, failed_plans=monitor.failed_plans + 1, came_to_nothing=True)
        return _look_again(monitor, now, config, f"no next plan: {problem}")
    if now.time > monitor.request.start.time + PUBLICATION_TIME:
        lead = monitor.lead + (0.0 if _is_cut(monitor, now) else _MORE_LEAD)
        monitor = replace(monitor, late_plans=monitor.late_plans + 1, lead=lead)
        return _look_again(monitor, now, config, "the next plan is late")
    return monitor


def _look_again(monitor: Monitor, now: Situation, config: MonitorConfig, reason: str) -> Monitor:
    """Asks once more, from later on, if the ground has been seen better since and there is time; else walks to the end."""
    monitor, start = replace(monitor, reason=reason), _start_ahead(monitor, now, config)
    seen_better = now.regions_stamp > monitor.request.stamp and not _is_cut(monitor, now)
    if start is None or not seen_better or start.time <= monitor.request.start.time:
        return replace(monitor, last_one=True)
    return replace(_counted(monitor, BETTER_VIEW), **_asking(monitor, now, config, start))


def _is_cut(monitor: Monitor, now: Situation) -> bool:
    """Whether the reference that is followed has to end early."""
    return monitor.cut.follows == now.reference.request_id


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
