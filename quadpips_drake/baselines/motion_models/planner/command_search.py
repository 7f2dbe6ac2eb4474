"""The search over velocity commands as a plain function: from a state between two steps and a foot costmap to a plan.

Taouil et al., section IV, Algorithm 1. Actions are velocity commands, a node is the robot at an exchange of the feet, its
children are what the motion models predict for each action; those with an unsafe foothold are pruned. Where we depart from
the paper is said in docs/motion_models.md.
"""

from copy import copy
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from quadpips_drake.baselines.motion_models.line_holding import LARGEST_DRIFT, OFFSET_GAIN, Line
from quadpips_drake.baselines.motion_models.models import MotionModels
from quadpips_drake.baselines.motion_models.planner import search_kernels as kernels
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmap
from quadpips_drake.baselines.motion_models.planner.margins import clearances
from quadpips_drake.baselines.motion_models.state import (
    BASE_SHIFT,
    FEET_SHIFT,
    NEXT_VELOCITY,
    OUTPUTS,
    PAIRS,
    StepState,
)
from quadpips_drake.compiling import work_clock
from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.values.immutable import ImmutableValue

MAX_STEPS = 20
"""Longest horizon; the paper's are 3, 5 and 7."""


@configuration
class CommandSearchConfig:
    """Actions, horizon and costs of the search."""

    horizon: int = ranged(7, 1, MAX_STEPS)
    """Steps of a plan [1]."""
    min_speed: float = ranged(0.0, -1.0, 2.0)
    """Slowest forward command [m/s] ..."""
    max_speed: float = ranged(1.0, 0.0, 2.0)
    """... and fastest [m/s]; of learned models no faster than their data."""
    speed_step: float = ranged(0.1, 0.01, 1.0)
    """Distance of forward commands [m/s]."""
    sideways: float = ranged(0.0, 0.0, 0.5)
    """With each forward command there are two more that also go this fast to the left and to the right [m/s]; 0: none."""
    clearance: float = ranged(0.02, 0.0, 0.5)
    """Least distance of a foothold to unsafe cells [m]."""
    clearance_sigmas: float = ranged(0.0, 0.0, 10.0)
    """... and least one as multiple of the standard deviation of where the foot will come down, which grows along the
    horizon [1]; 0: the constant alone."""
    safety_margin: float = ranged(0.10, 0.0, 1.0)
    """Nearer to unsafe cells than this a foothold costs what is missing: d_max of the paper [m]."""
    clearance_weight: float = ranged(1.0, 0.0, 1000.0)
    """Of that cost, against the distance to the goal [1]."""
    max_height_change: float = ranged(0.07, 0.0, 1.0)
    """How much higher or lower than before a foot may come down [m]."""
    preferred_speed: float = ranged(0.4, -1.0, 2.0)
    """Forward command that costs nothing [m/s]."""
    speed_weight: float = ranged(5.0, 0.0, 1000.0)
    """Cost of the squared difference from it [s^2/m]."""
    resolution: float = ranged(0.01, 0.001, 1.0)
    """Positions of the base closer than this are one [m]."""
    accumulate: bool = False
    """Whether costs add up along a plan; the paper compares those of the last nodes alone."""
    far_horizon: int = ranged(10, 1, MAX_STEPS)
    """Least number of steps of a plan for a robot that treads on the spot [1]."""
    max_expansions: int = ranged(400, 1, 20_000)
    """Nodes that are expanded at most [1]."""
    far_expansions: int = ranged(4000, 1, 20_000)
    """... for a robot that treads on the spot, if this is more [1]."""

    def __post_init__(self):
        if self.max_speed < self.min_speed:
            raise UserInputError(f"max_speed must be at least min_speed, {self.min_speed:g} m/s, not {self.max_speed:g} m/s")
        if not 1 <= len(self.actions()) <= kernels.MAX_ACTIONS:
            raise UserInputError(
                f"speed_step makes {len(self.actions())} commands, at most {kernels.MAX_ACTIONS} are allowed"
            )

    def actions(self) -> np.ndarray:
        """Forward command, and left one beside the hold's [m/s], (m, 2)."""
        count = int(np.floor((self.max_speed - self.min_speed) / self.speed_step + 1e-6)) + 1
        forward = np.round(self.min_speed + self.speed_step * np.arange(count), 9)
        aside = [0.0, self.sideways, -self.sideways] if self.sideways > 0.0 else [0.0]
        return np.array([(speed, more) for speed in forward for more in aside])


class PlanKind(StrEnum):
    """Where a command comes from."""

    NONE = "none"
    """There is none."""
    FULL = "full"
    """The search found safe footholds over the whole horizon."""
    TO_GOAL = "to_goal"
    """It found safe footholds up to the goal."""
    REST = "rest"
    """It found nothing; the rest of the last plan goes on."""
    CLEAREST = "clearest"
    """It found nothing, and nothing is left; the next footholds are those furthest from unsafe cells."""
    STOP = "stop"
    """No foothold is safe; the robot is to stop."""
    BLIND = "blind"
    """Nobody searched."""


@dataclass(frozen=True, eq=False)
class VelocityPlan(ImmutableValue):
    """Commands for the coming steps and what they are predicted to lead to; frame W."""

    stamp: float
    """Time of the exchange that it begins with [s]."""
    id: int = 0
    """A new one for each plan."""
    kind: PlanKind = PlanKind.NONE
    commands: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    """Forward, left command of each step [m/s], (n, 2)."""
    bases: np.ndarray = field(default_factory=lambda: np.zeros((1, 2)))
    """x, y of the base now and after each step [m], (n + 1, 2)."""
    feet: np.ndarray = field(default_factory=lambda: np.zeros((1, 4, 3)))
    """Ground points under the feet now and after each step [m], (n + 1, 4, 3)."""
    swing: int = 0
    """Which of PAIRS swings in the first step; they take turns."""
    cost: float = 0.0
    """Of the first node [m]."""
    clearance: float = 0.0
    """Least distance of a planned foothold to unsafe cells [m]."""
    expansions: int = 0
    elapsed: float = 0.0
    """Wall-clock time of the search [s]."""
    reason: str = ""
    """Why the search found nothing; empty where it did."""

    @staticmethod
    def empty() -> "VelocityPlan":
        """There is no plan yet."""
        return VelocityPlan(-np.inf)

    @property
    def found(self) -> bool:
        """Whether the search found it."""
        return self.kind in (PlanKind.FULL, PlanKind.TO_GOAL)


class CommandSearch:
    """Searches with the models of one walk."""

    def __init__(
        self,
        models: MotionModels,
        config: CommandSearchConfig | None = None,
        *,
        acceleration: float = np.inf,
        goal_tolerance: float = 0.1,
    ):
        """
        Args:
            models: what commands lead to.
            config: of the search.
            acceleration: how fast the walk takes up commands [m/s^2]; infinite: the models say all.
            goal_tolerance: the base is at the goal when it is this near [m].
        """
        self._models, self._config = models, config or CommandSearchConfig()
        self._acceleration, self._goal_tolerance = float(acceleration), goal_tolerance
        self._actions = _learned(self._config.actions(), models)
        steps, least = max(self._config.horizon, self._config.far_horizon), self._config.clearance
        self._clearances = [clearances(models, swing, steps, least, self._config.clearance_sigmas) for swing in (0, 1)]

    @property
    def models(self) -> MotionModels:
        """With which it searches."""
        return self._models

    def believing(self, models: MotionModels) -> "CommandSearch":
        """The same search with other models of the same walk."""
        other = copy(self)
        other._models = models
        return other

    def looking_further(self) -> "CommandSearch":
        """The same search for a robot that treads on the spot: over more steps, with costs that add up.

        Costs of last nodes alone do not tell a plan that goes now from one that stands first and goes then; whoever uses
        the first command of each plan may find one of the second kind for ever.
        """
        other, c = copy(self), self._config
        horizon, expansions = max(c.horizon, c.far_horizon), max(c.max_expansions, c.far_expansions)
        other._config = replace(c, horizon=horizon, accumulate=True, max_expansions=expansions)
        return other

    def plan(self, start: StepState, heights: np.ndarray, turn: float, costmap: FootCostmap, goal, line: Line, **labels):
        """The best plan from ``start``; one whose kind is NONE and whose reason says why, if there is none.

        Args:
            start: state at an exchange.
            heights: of the ground under the feet in W [m], (4,).
            turn: yaw rate that is commanded beside the plan [rad/s].
            costmap: where feet may come down.
            goal: x, y in W [m], (2,).
            line: that is kept to.
            labels: ``stamp`` and ``id`` of the plan.

        Returns: VelocityPlan.
        """
        began = work_clock()
        node, walk, ground, rules = self._problem(start, heights, turn, costmap, goal, line)
        end, expansions, rows, actions, costs, distances = kernels.search_commands(node, start.swing, walk, ground, rules)
        elapsed = work_clock() - began
        if end not in (kernels.FOUND, kernels.AT_GOAL):
            steps = len(actions) - 1
            why = "every way" if end == kernels.EXHAUSTED else f"{expansions} expansions"
            reason = f"{why} ended without {self._config.horizon} safe steps, the longest after {steps}"
            return VelocityPlan(**labels, swing=start.swing, expansions=expansions, elapsed=elapsed, reason=reason)
        return VelocityPlan(
            **labels,
            kind=PlanKind.FULL if end == kernels.FOUND else PlanKind.TO_GOAL,
            commands=rows[1:, kernels.NODE_COMMAND].copy(),
            bases=rows[:, kernels.NODE_POSITION].copy(),
            feet=_feet_of(rows, start.yaw),
            swing=start.swing,
            cost=float(costs[1]),
            clearance=float(distances[1:].min()),
            expansions=expansions,
            elapsed=elapsed,
        )

    def clearest(self, start: StepState, heights: np.ndarray, turn: float, costmap: FootCostmap, goal, line: Line):
        """Forward, left command [m/s] (2,) whose footholds are furthest from unsafe cells, and that distance [m].

        The distance is 0 if none of them is safe. The arguments are those of ``plan``.
        """
        node, walk, ground, rules = self._problem(start, heights, turn, costmap, goal, line)
        action, clearance = kernels.clearest_step(node, start.swing, walk, ground, rules)
        forward, more = self._actions[action]
        return np.array([forward, kernels.left_command(*start.position, more, rules)]), float(clearance)

    def clearance_of(
        self, commands: np.ndarray, start: StepState, heights, turn: float, costmap: FootCostmap, goal, line: Line
    ):
        """Least distance to unsafe cells of the footholds that ``commands`` (n, 2) lead to [m]; 0 if one is not safe.

        The other arguments are those of ``plan``.
        """
        node, walk, ground, rules = self._problem(start, heights, turn, costmap, goal, line)
        least, distances = np.inf, np.zeros(2)
        for step, (forward, left) in enumerate(commands):
            swing, child = (start.swing + step) % 2, np.empty(kernels.NODE_SIZE)
            kernels.predict_step(node, swing, step == 0, float(forward), float(left), walk, child)
            kernels.land(child, swing, walk, ground, rules.max_height_change, distances)
            node, least = child, min(least, *distances)
        return float(least)

    def outcome(self, start: StepState, command: np.ndarray) -> np.ndarray:
        """What the models give out for the step that begins at ``start`` with ``command`` (3,): (OUTPUTS,)."""
        node, child = _node(start, np.zeros(4)), np.empty(kernels.NODE_SIZE)
        kernels.predict_step(node, start.swing, True, command[0], command[1], self._walk(start, command[2]), child)
        outputs, R_WB = np.empty(OUTPUTS), yaw_matrix(start.yaw)[:2, :2]
        shift = (child[kernels.NODE_POSITION] - start.position) @ R_WB
        feet = child[kernels.NODE_FEET].reshape(4, 2) - start.feet + shift
        outputs[BASE_SHIFT], outputs[FEET_SHIFT] = shift, feet[list(PAIRS[start.swing])].ravel()
        outputs[NEXT_VELOCITY] = child[kernels.NODE_VELOCITY]
        return outputs

    def _walk(self, start: StepState, turn: float) -> kernels.Walk:
        rate, before, models = start.yaw_rate, start.previous_yaw_rate, self._models
        turns = np.array([[rate, before, turn, start.previous_command[2]], [rate, rate, turn, turn]])
        heading = np.array([np.cos(start.yaw), np.sin(start.yaw)])
        return kernels.Walk(models.coefficients, self._acceleration, float(models.step_duration), turns, heading)

    def _problem(self, start: StepState, heights, turn: float, costmap: FootCostmap, goal, line: Line):
        """What the kernels take: the first node, Walk, Map and Rules."""
        c, node, walk = self._config, _node(start, heights), self._walk(start, turn)
        ground = kernels.Map(costmap.height, costmap.distance, costmap.corner, costmap.cell)
        rules = kernels.Rules(
            actions=self._actions,
            horizon=c.horizon,
            clearance=self._clearances[start.swing],
            max_height_change=c.max_height_change,
            margin=c.safety_margin,
            clearance_weight=c.clearance_weight,
            preferred_speed=c.preferred_speed,
            speed_weight=c.speed_weight,
            goal=np.array(goal, dtype=float),
            goal_tolerance=self._goal_tolerance,
            line=np.array([*line.point, -np.sin(line.heading), np.cos(line.heading)]),
            hold_gain=OFFSET_GAIN,
            hold_limit=LARGEST_DRIFT,
            resolution=c.resolution,
            accumulate=c.accumulate,
            max_expansions=c.max_expansions,
        )
        return node, walk, ground, rules


def _learned(actions: np.ndarray, models: MotionModels) -> np.ndarray:
    """Those of the ``actions`` that are no faster than what the models' data hold; the slowest ones at least."""
    fastest = max(models.top_speed, actions[:, 0].min()) if models.top_speed > 0.0 else np.inf
    return actions[actions[:, 0] <= fastest + 1e-9]


def _node(start: StepState, heights: np.ndarray) -> np.ndarray:
    """The row of the node at ``start``, with the heights of the ground under its feet in W [m], (4,)."""
    node = np.empty(kernels.NODE_SIZE)
    node[kernels.NODE_POSITION], node[kernels.NODE_VELOCITY] = start.position, start.velocity
    node[kernels.NODE_PREVIOUS_VELOCITY], node[kernels.NODE_COMMAND] = start.previous_velocity, start.previous_command[:2]
    node[kernels.NODE_FEET], node[kernels.NODE_HEIGHTS] = start.feet.ravel(), heights
    return node


def _feet_of(rows: np.ndarray, yaw: float) -> np.ndarray:
    """Ground points under the feet of nodes (n, NODE_SIZE) in W [m], (n, 4, 3)."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    feet_B = rows[:, kernels.NODE_FEET].reshape(-1, 4, 2)
    feet = np.empty((len(rows), 4, 3))
    feet[:, :, 0] = rows[:, None, 0] + cos * feet_B[:, :, 0] - sin * feet_B[:, :, 1]
    feet[:, :, 1] = rows[:, None, 1] + sin * feet_B[:, :, 0] + cos * feet_B[:, :, 1]
    feet[:, :, 2] = rows[:, kernels.NODE_HEIGHTS]
    return feet
