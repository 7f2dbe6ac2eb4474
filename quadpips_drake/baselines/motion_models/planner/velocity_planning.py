"""Walking by a plan of velocity commands: what to command now, decided anew at each exchange of the feet.

Of each plan the first command is used, as in the paper; then all is planned again. Where the search finds nothing, the rest
of the last plan goes on, while its footholds are safe from where the robot is, on the newest map; where nothing is left of
it, the robot takes the footholds that are furthest from unsafe cells; where none is safe, it stops. Each of these is
counted. A robot that treads on the spot although there are plans looks further ahead. Of the walk this knows nothing: it
sees the robot, the map and its own commands.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from quadpips_drake.baselines.motion_models.line_holding import Line, command_on_line
from quadpips_drake.baselines.motion_models.planner.adaptation import Adaptation
from quadpips_drake.baselines.motion_models.planner.command_search import CommandSearch, PlanKind, VelocityPlan
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmap
from quadpips_drake.baselines.motion_models.planner.prediction_errors import PredictionErrors
from quadpips_drake.baselines.motion_models.planner.velocity_planner_config import VelocityPlannerConfig
from quadpips_drake.baselines.motion_models.state import StepState, measured_outputs
from quadpips_drake.baselines.motion_models.step_watch import StepWatch, watch_steps
from quadpips_drake.control.references.velocity_reference import STANCE
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import PlannerPhase, SafetyStatus

FALLBACKS = {PlanKind.REST: "rest_of_last_plan", PlanKind.CLEAREST: "largest_clearance", PlanKind.STOP: "stopped"}
"""How fallbacks are called in a status."""
STUCK = "stuck"
"""How it is called there that the robot came no nearer to the goal and had to look further ahead."""
_AT_GOAL = "the base is at the goal"
_SAME_PLACE = 1e-3
"""[m]"""


@dataclass(frozen=True, eq=False)
class PlanningMemory(ImmutableValue):
    """What the planner remembers; begins as ``PlanningMemory()``."""

    stamp: float = -np.inf
    """[s]"""
    phase: PlannerPhase = PlannerPhase.STANDING_UP
    reason: str = ""
    since: float = -np.inf
    """When the phase began [s]."""
    gait: str = STANCE
    command: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """Forward, left [m/s], yaw rate [rad/s], (3,)."""
    line: Line | None = None
    goal: np.ndarray = field(default_factory=lambda: np.full(2, np.nan))
    """For which the line was laid, x, y in W [m], (2,)."""
    watch: StepWatch = field(default_factory=StepWatch)
    """The steps of the robot."""
    predicted: np.ndarray | None = None
    """What the models say about the step that began there, (OUTPUTS,)."""
    plan: VelocityPlan = field(default_factory=VelocityPlan.empty)
    """The newest plan that the search found, or what took its place."""
    used: int = 0
    """How many of its commands have been used."""
    plans: int = 0
    """Searches so far."""
    failures: int = 0
    """Of them without result, in a row."""
    mark: float = np.inf
    """Distance to the goal when the robot made progress last [m]."""
    idle: int = 0
    """Plans since then."""
    fallbacks: tuple[tuple[str, int], ...] = ()
    """(name, how often so far)."""
    broken_off: int = 0
    """How often the walk was broken off because the robot was unstable."""
    errors: PredictionErrors = field(default_factory=PredictionErrors)
    adaptation: Adaptation | None = None
    """The models as they are believed now; None: as they were learned."""
    first_errors: PredictionErrors = field(default_factory=PredictionErrors)
    """Of the models as they were learned, where there are others by now."""
    cost: float = 0.0
    """Sum over all plans of what their first node costs [m]."""
    expansions: int = 0
    """Over all searches."""
    elapsed: float = 0.0
    """Wall-clock time of all searches [s]."""
    distance: float = np.nan
    """From the base to the goal at the last decision [m]."""

    @property
    def gave_up(self) -> bool:
        """Whether it will stand from now on."""
        return self.phase == PlannerPhase.NO_PLAN


class VelocityPlanning:
    """Decides what to command: one ``update`` each time that the robot is looked at."""

    def __init__(self, robot, gait: str, config: VelocityPlannerConfig, search: CommandSearch | None):
        """Args: RobotModel; name of the gait; settings; what finds plans, None: nobody looks where feet come down."""
        self._robot, self._gait, self._config, self._search = robot, gait, config, search

    def update(
        self, memory: PlanningMemory, state: RobotState, goal: np.ndarray, safety: SafetyStatus, costmap
    ) -> PlanningMemory:
        """The next memory; the same one where nothing has happened.

        Args:
            memory: of the last look.
            state: of the robot, estimated.
            goal: x, y in W [m], (2,).
            safety: while it is unstable the plan is dropped and the robot stands.
            costmap: function that returns the FootCostmap of this moment; called only when it is needed.
        """
        if not state.is_known or memory.gave_up:
            return memory
        now = state.stamp
        memory = replace(memory, stamp=now)
        if safety.unstable:
            if memory.phase == PlannerPhase.RECOVERING:
                return memory
            memory = replace(memory, broken_off=memory.broken_off + 1)
            return self._standing(memory, PlannerPhase.RECOVERING, f"unstable: {safety.reason}")
        if not np.array_equal(goal, memory.goal):
            memory = replace(memory, line=_line_to(goal, state), goal=np.array(goal, dtype=float), mark=np.inf, idle=0)
        if memory.gait == STANCE:
            return self._begun(memory, state, costmap)
        feet = self._robot.foot_positions_W(state)
        watch, begins = watch_steps(memory.watch, state, feet, memory.command)
        if begins:
            return self._at_exchange(memory, watch, state, feet, costmap)
        return replace(memory, watch=watch)

    def _standing(self, memory: PlanningMemory, phase: PlannerPhase, reason: str) -> PlanningMemory:
        """Stop and stand: whatever was planned or is remembered of the walk is dropped."""
        return replace(
            memory,
            phase=phase,
            reason=reason,
            since=memory.stamp if phase != memory.phase else memory.since,
            gait=STANCE,
            command=np.zeros(3),
            watch=StepWatch(),
            predicted=None,
            plan=replace(VelocityPlan.empty(), id=memory.plan.id),
            used=0,
        )

    def _begun(self, memory: PlanningMemory, state: RobotState, costmap) -> PlanningMemory:
        """Out of standing: the walk begins on the spot as soon as there is a map and something to walk for."""
        c, memory = self._config, replace(memory, distance=_distance(memory, state))
        if memory.distance <= (c.restart_distance if memory.phase == PlannerPhase.GOAL_REACHED else c.goal_tolerance):
            return self._standing(memory, PlannerPhase.GOAL_REACHED, _AT_GOAL)
        if memory.phase == PlannerPhase.PAUSING and memory.stamp < memory.since + c.pause:
            return memory
        problem = self._problem_with(costmap(), memory.stamp) if self._search is not None else ""
        if problem:
            waiting = self._standing(memory, PlannerPhase.PLANNING, problem)
            if memory.stamp - waiting.since > c.max_wait:
                return replace(waiting, phase=PlannerPhase.NO_PLAN)
            return waiting
        phase, reason = PlannerPhase.WALKING, "begins on the spot"
        return replace(memory, phase=phase, reason=reason, since=memory.stamp, gait=self._gait, command=np.zeros(3))

    def _problem_with(self, costmap: FootCostmap, now: float) -> str:
        """Why nobody can plan with a map; empty if one can."""
        if costmap.height.size == 0:
            return "there is no map of the ground"
        if not costmap.distance.any():
            return "no ground in the map is known to be safe"
        age = now - costmap.stamp
        if not age <= self._config.max_map_age:
            return f"the map of the ground is {age:.1f} s old"
        return ""

    def _at_exchange(self, memory: PlanningMemory, watch: StepWatch, state, feet: np.ndarray, costmap) -> PlanningMemory:
        """A step ends and the next one begins."""
        before, step = memory.watch.state, watch.state
        if before is not None and memory.predicted is not None and step.swing != before.swing:
            memory = self._compared(memory, before, measured_outputs(before, step))
        memory = replace(memory, watch=watch, predicted=None, distance=_distance(memory, state))
        if self._is_at_goal(memory, step):
            return self._standing(memory, PlannerPhase.GOAL_REACHED, _AT_GOAL)
        held = command_on_line(self._config.blind_speed, memory.line, step)
        if self._search is None:
            plan = VelocityPlan(memory.stamp, memory.plan.id + 1, PlanKind.BLIND, held[None, :2])
            return self._with_command(memory, plan, 0, held[2])
        ground = costmap()
        problem = self._problem_with(ground, memory.stamp)
        if problem:
            return self._standing(memory, PlannerPhase.NO_PLAN, problem)
        return self._searched(memory, self._robot.soles_W(feet)[:, 2], held[2], ground)

    def _is_at_goal(self, memory: PlanningMemory, step: StepState) -> bool:
        """Whether to stop: near enough; or past the goal, a little aside of it, where going on leads away from it."""
        heading = memory.line.heading
        ahead = (memory.goal - step.position) @ [np.cos(heading), np.sin(heading)]
        return memory.distance <= (self._config.goal_tolerance if ahead > 0.0 else self._config.restart_distance)

    def _compared(self, memory: PlanningMemory, before: StepState, measured: np.ndarray) -> PlanningMemory:
        """With the errors of the predictions for a step that began at ``before``, and what is learned from them."""
        memory, config = replace(memory, errors=memory.errors.with_step(memory.predicted, measured)), self._config.adaptation
        if not config.enabled:
            return memory
        errors = memory.first_errors.with_step(self._search.outcome(before, memory.command), measured)
        adaptation = memory.adaptation or Adaptation.begin(self._search.models, config)
        adaptation = adaptation.after(before.inputs(memory.command), measured, before.swing, config)
        return replace(memory, first_errors=errors, adaptation=adaptation)

    def _search_of(self, memory: PlanningMemory) -> CommandSearch:
        """The search with what is believed now, and as far ahead as it takes to get on."""
        search = self._search if memory.adaptation is None else self._search.believing(memory.adaptation.models)
        return search.looking_further() if memory.idle >= self._config.patience else search

    def _getting_on(self, memory: PlanningMemory) -> PlanningMemory:
        """With how long the robot has come no nearer to the goal."""
        if memory.distance <= memory.mark - self._config.progress:
            return replace(memory, mark=memory.distance, idle=0)
        memory = replace(memory, idle=memory.idle + 1)
        return _counting(memory, STUCK) if memory.idle == self._config.patience else memory

    def _searched(self, memory: PlanningMemory, heights: np.ndarray, turn: float, ground: FootCostmap) -> PlanningMemory:
        """With the command of a new plan, or of what takes its place."""
        question = memory.watch.state, heights, turn, ground, memory.goal, memory.line
        memory = self._getting_on(memory)
        if memory.idle > self._config.max_idle:
            reason = f"{memory.idle} plans have brought it less than {self._config.progress:g} m nearer to the goal"
            return self._standing(memory, PlannerPhase.NO_PLAN, reason)
        search = self._search_of(memory)
        plan = search.plan(*question, stamp=memory.stamp, id=memory.plan.id + 1)
        memory = replace(
            memory,
            plans=memory.plans + 1,
            failures=0 if plan.found else memory.failures + 1,
            cost=memory.cost + plan.cost,
            expansions=memory.expansions + plan.expansions,
            elapsed=memory.elapsed + plan.elapsed,
        )
        if plan.found:
            return self._with_command(memory, plan, 0, turn)
        if memory.failures > self._config.max_failures:
            return self._standing(memory, PlannerPhase.NO_PLAN, f"{memory.failures} searches in a row: {plan.reason}")
        left = memory.plan.commands[memory.used :]
        if memory.plan.found and len(left) and search.clearance_of(left, *question) > 0.0:
            rest = replace(memory.plan, id=plan.id, reason=plan.reason)
            return self._with_command(_counting(memory, FALLBACKS[PlanKind.REST]), rest, memory.used, turn)
        command, clearance = search.clearest(*question)
        if clearance <= 0.0:
            stopped = self._standing(
                _counting(memory, FALLBACKS[PlanKind.STOP]), PlannerPhase.PAUSING, f"no safe foothold: {plan.reason}"
            )
            return replace(stopped, plan=replace(plan, kind=PlanKind.STOP))
        plan = replace(plan, kind=PlanKind.CLEAREST, commands=command[None], clearance=clearance)
        return self._with_command(_counting(memory, FALLBACKS[PlanKind.CLEAREST]), plan, 0, turn)

    def _with_command(self, memory: PlanningMemory, plan: VelocityPlan, used: int, turn: float) -> PlanningMemory:
        """With the command number ``used`` of a plan."""
        command = np.array([*plan.commands[used], turn])
        predicted = self._search_of(memory).outcome(memory.watch.state, command) if self._search is not None else None
        words = {PlanKind.FULL: "a plan", PlanKind.TO_GOAL: "a plan to the goal", PlanKind.BLIND: "without looking"}
        reason = words.get(plan.kind, plan.reason) if not plan.reason else f"no plan: {plan.reason}"
        return replace(
            memory, phase=PlannerPhase.WALKING, reason=reason, command=command, predicted=predicted, plan=plan, used=used + 1
        )


def _distance(memory: PlanningMemory, state: RobotState) -> float:
    """From the base to the goal [m]."""
    return float(np.hypot(*(memory.goal - state.p_WB[:2])))


def _line_to(goal: np.ndarray, state: RobotState) -> Line:
    """The straight way from where the robot is; where that is the goal, in the direction in which it looks."""
    way = goal - state.p_WB[:2]
    heading = np.arctan2(way[1], way[0]) if np.hypot(*way) > _SAME_PLACE else state.rpy_WB[2]
    return Line(np.array(goal, dtype=float), float(heading))


def _counting(memory: PlanningMemory, name: str) -> PlanningMemory:
    """With one more of what a status calls by this name."""
    counts = dict(memory.fallbacks)
    counts[name] = counts.get(name, 0) + 1
    return replace(memory, fallbacks=tuple(counts.items()))
