"""Foothold search: A* over contact-mode families (QuadPiPS section VI-C)."""

import heapq
from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.compiling import work_clock
from quadpips_drake.gaits.swing_gaits import SwingGait, swing_gait
from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.planning.appeared_ground import SWING_ROOM, lead_over, outlines
from quadpips_drake.planning.footholds.escalation import careful, escalated
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.gait_choice import need_of_care
from quadpips_drake.planning.footholds.refused_swings import are_refused
from quadpips_drake.planning.footholds.stance_rules import REJECTIONS, make_transition_model, stance_deviation
from quadpips_drake.planning.footholds.stance_transitions import cost_rate, distance_to_go, expand
from quadpips_drake.planning.nominal_pose import base_pose_above
from quadpips_drake.planning.region_table import make_region_table, may_carry_a_foot
from quadpips_drake.planning.start_stance import attach_feet
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, RefusedSwings, Stance, TorsoPath
from quadpips_drake.values.robot_state import RobotState

_CELL = 0.02
"""Footholds of the same leg in the same cell of this size [m] count as one in the identity of a node."""


@dataclass(slots=True)
class _Node:
    """A contact-mode family, with the full stance that led to it.

    The family is the phase and what the legs stand on that do not swing in it; the swinging legs only matter as the places
    where they lift off. Nodes with the same family are merged: the cheaper way to it wins.
    """

    phase: int
    feet: np.ndarray
    normals: np.ndarray
    regions: np.ndarray
    p_WB: np.ndarray
    rpy_WB: np.ndarray
    cost: float
    to_go: float
    parent: int
    depth: int


@dataclass
class _Result:
    """Outcome of the search for one waypoint."""

    node: int = -1
    complete: bool = False
    expansions: int = 0
    refused: np.ndarray = field(default_factory=lambda: np.zeros(len(REJECTIONS), dtype=np.int64))
    combinations: int = 0
    reason: str = ""
    time_limit_hit: bool = False


class _Search:
    """One A* search from a start stance towards the last pose of a path."""

    def __init__(
        self,
        gait: SwingGait,
        config: FootholdConfig,
        model,
        table,
        path: np.ndarray,
        deadline: float,
        refused: RefusedSwings,
    ):
        self._phases = [np.array(phase, dtype=np.int64) for phase in gait.phases]
        self._config = config
        self._model = model
        self._table = table
        self._path = path
        self._deadline = deadline
        self._refused, self._things = refused, outlines(refused.appeared, SWING_ROOM)
        self._rate = cost_rate(config)
        turns = np.abs(wrap_angle(np.diff(path[:, 2])))
        legs = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1) + config.yaw_weight * turns
        self._remaining = np.append(np.cumsum(legs[::-1])[::-1], 0.0)
        self._open: list = []
        self._best_cost: dict = {}
        self._pushed = 0
        self.nodes: list[_Node] = []

    def run(self, feet, normals, regions) -> _Result:
        """Searches from the start stance; the result's node is the end of the plan, or -1."""
        p_WB, rpy_WB = base_pose_above(feet, self._model.base_height, self._model.max_tilt)
        to_go = self._way_to_go(p_WB, rpy_WB)
        for phase in range(len(self._phases) if self._config.any_first_phase else 1):
            self._push(_Node(phase, feet, normals, regions, p_WB, rpy_WB, 0.0, to_go, -1, 0))
        result = _Result()
        while self._open:
            _, _, _, index, terminal = heapq.heappop(self._open)
            node = self.nodes[index]
            if terminal:
                result.node, result.complete = index, self._is_at_waypoint(node)
                return result
            if node.cost > self._best_cost[self._family(node)] or node.depth == self._config.max_steps:
                continue
            if result.expansions >= self._config.max_expansions:
                bound = f"the bound of {self._config.max_expansions} expansions was reached"
                return self._best_effort(result, f"{bound}; {self._dead_end(result)}")
            if work_clock() > self._deadline:
                result.time_limit_hit = True
                return self._best_effort(result, f"the time limit of {self._config.time_limit:g} s was reached")
            result.expansions += 1
            self._expand(index, node, result)
        return self._best_effort(result, self._dead_end(result))

    def stances(self, index: int) -> list[_Node]:
        """Returns the nodes from the start to ``index``."""
        chain = []
        while index >= 0:
            chain.append(self.nodes[index])
            index = self.nodes[index].parent
        return chain[::-1]

    def swing_legs(self, node: _Node) -> tuple[Leg, ...]:
        """Returns the legs that swing from ``node`` on."""
        return tuple(Leg(int(leg)) for leg in self._phases[node.phase])

    def _expand(self, index: int, node: _Node, result: _Result):
        """Adds the permitted stances after one swing, the most promising ones."""
        legs = self._phases[node.phase]
        feet, normals, regions, p_WB, rpy, costs, ways, refused = expand(
            node.feet, node.normals, node.regions, legs, node.p_WB, node.rpy_WB,
            self._path, self._remaining, self._table, self._model,
        )  # fmt: skip
        result.refused += refused
        result.combinations += len(costs) + int(refused.sum())
        following = (node.phase + 1) % len(self._phases)
        promise = costs + self._config.heuristic_inflation * self._rate * ways
        if self._refused.swings:
            promise[are_refused(self._refused.swings, self.swing_legs(node), node.feet, feet)] = np.inf
        if self._things:
            promise[lead_over(self._things, self.swing_legs(node), node.feet, feet)] = np.inf
        for k in np.argsort(promise, kind="stable")[: self._config.max_children]:
            if not np.isfinite(promise[k]):
                break
            cost = node.cost + costs[k]
            self._push(
                _Node(following, feet[k], normals[k], regions[k], p_WB[k], rpy[k], cost, ways[k], index, node.depth + 1)
            )

    def _push(self, node: _Node):
        """Queues a node unless a way at least as cheap to its family is known; and the end of the plan, if it may be one."""
        family = self._family(node)
        if node.cost >= self._best_cost.get(family, np.inf):
            return
        self._best_cost[family] = node.cost
        self.nodes.append(node)
        index = len(self.nodes) - 1
        estimate = node.cost + self._config.heuristic_inflation * self._rate * node.to_go
        self._queue(estimate, node.depth, index, terminal=False)
        if self._may_end(node):
            self._queue(estimate + self._final_cost(node), node.depth, index, terminal=True)

    def _queue(self, estimate: float, depth: int, index: int, terminal: bool):
        # Of equal estimates the deeper node goes first; the counter makes the order, and so the plan, reproducible.
        self._pushed += 1
        heapq.heappush(self._open, (estimate, -depth, self._pushed, index, terminal))

    def _family(self, node: _Node) -> tuple:
        """Identity of the contact-mode family: the phase, and region and place of each leg that stays down in it.

        Regions up to ``single_place`` in size are one place: on small stones centimetres make no other way, and a search
        that tells them apart comes to its bound before it has tried the stones.
        """
        swinging = set(self._phases[node.phase].tolist())
        standing = [leg for leg in range(4) if leg not in swinging]
        cells = np.floor(node.feet[standing] / _CELL).astype(np.int64)
        cells[self._table.radii[node.regions[standing]] <= self._config.single_place] = 0
        return (node.phase, *node.regions[standing].tolist(), *cells.ravel().tolist())

    def _final_cost(self, node: _Node) -> float:
        deviation = stance_deviation(node.feet, node.p_WB, node.rpy_WB[2], self._model.nominal, 0.0)
        return self._config.final_stance_weight * deviation

    def _may_end(self, node: _Node) -> bool:
        """A plan ends at the waypoint, or, if that is further than its steps lead, somewhere nearer to it."""
        if node.depth == 0:
            return False
        if self._progress(node) < min(self._config.min_progress, 0.5 * self.nodes[0].to_go):
            return False
        return self._is_at_waypoint(node) or node.depth == self._config.max_steps

    def _progress(self, node: _Node) -> float:
        return self.nodes[0].to_go - node.to_go

    def _is_at_waypoint(self, node: _Node) -> bool:
        x, y, yaw = self._path[-1]
        near = np.hypot(node.p_WB[0] - x, node.p_WB[1] - y) <= self._config.goal_tolerance
        return near and abs(wrap_angle(node.rpy_WB[2] - yaw)) <= self._config.goal_yaw_tolerance

    def _way_to_go(self, p_WB, rpy_WB) -> float:
        x, y, yaw = p_WB[0], p_WB[1], rpy_WB[2]
        return distance_to_go(x, y, yaw, self._path, self._remaining, self._config.yaw_weight)[0]

    def _best_effort(self, result: _Result, reason: str) -> _Result:
        """Ends a search that did not arrive: with the stance that is best to wait in, among those with some progress."""
        result.reason = reason
        candidates = [k for k, node in enumerate(self.nodes) if self._progress(node) >= self._config.min_progress]
        if candidates:
            result.node = min(candidates, key=lambda k: self._rate * self.nodes[k].to_go + self._final_cost(self.nodes[k]))
        return result

    def _dead_end(self, result: _Result) -> str:
        """Says in words what kept the search from coming nearer."""
        if result.combinations == 0:
            return "no foothold is within reach of the swinging legs"
        nearest = f"the steps found lead no nearer than {min(node.to_go for node in self.nodes):.2f} m to the waypoint"
        if not result.refused.any():
            return nearest
        worst = int(np.argmax(result.refused))
        share = 100.0 * result.refused[worst] / result.combinations
        return f"{nearest} ({share:.0f} % of {result.combinations} stances refused: {REJECTIONS[worst]})"


@dataclass(frozen=True)
class _Problem:
    """A start stance and the regions to step on; what all attempts of one search share."""

    usable: list
    """PlanarRegions that may carry a foot, and the patches under feet without perceived ground."""
    feet: np.ndarray
    normals: np.ndarray
    regions: np.ndarray
    """Indices of the start regions in ``usable``, (4,)."""


def _pose_problem(state: RobotState, regions, robot, config: FootholdConfig) -> _Problem:
    """Attaches the feet and collects the regions that may carry one."""
    usable = [region for region in regions.regions if may_carry_a_foot(region, config.max_slope)]
    attachments = attach_feet(state, usable, robot)
    usable += [attachment.region for attachment in attachments if not attachment.perceived]
    position = {id(region): k for k, region in enumerate(usable)}
    return _Problem(
        usable=usable,
        feet=np.array([attachment.point for attachment in attachments]),
        normals=np.array([attachment.region.normal for attachment in attachments]),
        regions=np.array([position[id(attachment.region)] for attachment in attachments]),
    )


def _local_path(state: RobotState, torso_path: TorsoPath, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns x, y, yaw of the leading poses of the torso path within ``radius`` [m], (n, 3), and the waypoint, (4,).

    The path starts at the base's present pose; the waypoint, x, y, z, yaw, is the last of these poses.
    """
    poses = torso_path.poses
    far = np.flatnonzero(np.hypot(*(poses[:, :2] - state.p_WB[:2]).T) > radius)
    count = max(int(far[0]) if len(far) else len(poses), min(2, len(poses)))
    path = poses[:count][:, [0, 1, 3]]
    if np.hypot(*(path[0, :2] - state.p_WB[:2])) > 1e-3:
        path = np.vstack([[*state.p_WB[:2], state.rpy_WB[2]], path])
    return np.ascontiguousarray(path, dtype=float), poses[count - 1]


def _prefix_lengths(count: int, retries: int) -> list[int]:
    """Returns how many poses of the path to follow, in the order of the attempts: all, then fewer, down to a quarter."""
    fewest = min(count, max(2, count // 4))
    return sorted({int(k) for k in np.linspace(count, fewest, retries + 1)}, reverse=True)


@dataclass
class _Attempt:
    """What the searches with one gait led to."""

    gait: SwingGait
    waypoint: np.ndarray
    search: _Search
    result: _Result
    """To make the plan of; its node is -1 when there is none."""
    expansions: int
    time_limit_hit: bool


def _attempt(
    problem: _Problem, state, torso_path, robot, config: FootholdConfig, deadline: float, refused: RefusedSwings
) -> _Attempt:
    """Searches for waypoints ever nearer along the torso path until one is reached."""
    path, waypoint = _local_path(state, torso_path, config.local_radius)
    gait, model, table = swing_gait(config.gait), make_transition_model(robot, config), make_region_table(problem.usable)
    attempts = []
    for count in _prefix_lengths(len(path), config.waypoint_retries):
        search = _Search(gait, config, model, table, path[:count], deadline, refused)
        result = search.run(problem.feet, problem.normals, problem.regions)
        result.complete &= count == len(path)
        attempts.append((search, result))
        if not result.reason:
            break
    expansions = sum(result.expansions for _, result in attempts)
    late = any(result.time_limit_hit for _, result in attempts)
    arrived = [attempt for attempt in attempts if not attempt[1].reason]
    partial = [attempt for attempt in attempts if attempt[1].node >= 0]
    return _Attempt(gait, waypoint, *(arrived + partial + attempts)[0], expansions, late)


def _need_of_care(attempt: _Attempt, config: FootholdConfig) -> str:
    """Why the plan found should rather be made of single swings; empty when it need not."""
    if config.gait == config.careful_gait:
        return ""
    chain = attempt.search.stances(attempt.result.node)
    feet, rpy = np.array([node.feet for node in chain]), np.array([node.rpy_WB for node in chain])
    return need_of_care(feet, rpy, config)


def search_footholds(
    state: RobotState, regions, torso_path: TorsoPath, robot, config: FootholdConfig, refused: RefusedSwings | None = None
) -> FootholdPlan:
    """Finds the swings that lead from where the robot stands towards the local waypoint on the torso path.

    A* over contact-mode families as in QuadPiPS section VI-C, its graph built lazily: phases of the gait in turn, footholds
    in the swinging legs' superquadrics (eq. 15), stable stances (eqs. 16-17), bounded swings (eq. 18). The waypoint is the
    last pose of the torso path within ``config.local_radius``. If nothing leads to it, earlier poses are tried; if nothing
    leads there either, the stance with the most progress ends the plan. A plan also ends after ``config.max_steps``.

    Args:
        state: measured state of the robot.
        regions: RegionSet to step on, in W.
        torso_path: result of the torso search; its ``level`` says how hard to try, see ``escalation``.
        refused: RefusedSwings; nothing like them is in the plan.

    Returns:
        A FootholdPlan; without stances and with a reason when there is none.
    """
    started, config = work_clock(), escalated(config, torso_path.level)
    if not torso_path.success:
        reason = torso_path.reason or "there is no torso path"
        return FootholdPlan(state.stamp, torso_path.request_id, reason=reason, complete=False)
    problem = _pose_problem(state, regions, robot, config)
    refused = refused or RefusedSwings.empty()
    attempt = _attempt(problem, state, torso_path, robot, config, started + config.time_limit, refused)
    need, expansions = _need_of_care(attempt, config), attempt.expansions
    if need:
        carefully = _attempt(problem, state, torso_path, robot, careful(config), started + config.time_limit, refused)
        expansions += carefully.expansions
        attempt = carefully if carefully.result.node >= 0 else attempt
    search, result = attempt.search, attempt.result
    chain, gait = search.stances(result.node), attempt.gait
    return FootholdPlan(
        stamp=state.stamp,
        request_id=torso_path.request_id,
        stances=tuple(
            Stance(node.feet, node.normals, tuple(problem.usable[k] for k in node.regions), node.p_WB, node.rpy_WB)
            for node in chain
        ),
        swing_legs=tuple(search.swing_legs(node) for node in chain[:-1]),
        gait=gait.name,
        swing_duration=gait.swing_duration,
        stance_duration=gait.stance_duration,
        gait_reason=need if attempt.gait.name != config.gait else "",
        waypoint=attempt.waypoint,
        reason="" if chain else result.reason,
        expansions=expansions,
        elapsed=work_clock() - started,
        complete=result.complete,
        time_limit_hit=attempt.time_limit_hit,
        considered=result.combinations,
        refusals={why: int(count) for why, count in zip(REJECTIONS, result.refused, strict=True) if count},
    )
