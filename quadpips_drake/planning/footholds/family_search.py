"""One A* search over contact-mode families (QuadPiPS section VI-C), its graph built as it goes."""

import heapq
import itertools
from collections import defaultdict
from collections.abc import Callable

import numpy as np

from quadpips_drake.compiling import work_clock
from quadpips_drake.gaits.swing_gaits import SwingGait
from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.planning.appeared_ground import SWING_ROOM, lead_over, outlines
from quadpips_drake.planning.experience.edge_experience import EdgeExperience
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_labels import FootholdLabels, cost_beyond_unseen
from quadpips_drake.planning.footholds.lazy_swings import LazySwings
from quadpips_drake.planning.footholds.refused_swings import are_refused
from quadpips_drake.planning.footholds.search_node import SearchNode, SearchResult, Stances
from quadpips_drake.planning.footholds.stance_rules import BLOCKED, NO_ROOM, REJECTIONS, arrivals, identities
from quadpips_drake.planning.footholds.stance_transitions import cost_rate, distance_to_go, expand
from quadpips_drake.planning.nominal_pose import base_pose_above
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import RefusedSwings

_STUCK_WAY = 0.3
"""How much longer the way to go is taken to be for each foot that does not get over what it stands beside [m]."""
_NEARER = 0.02
"""A search comes nearer to its waypoint in steps of this at least [m]."""


class FamilySearch:
    """One A* search from a start stance towards the last pose of a path."""

    def __init__(
        self,
        gait: SwingGait,
        config: FootholdConfig,
        model,
        table,
        labels: FootholdLabels,
        path: np.ndarray,
        deadline: float,
        refused: RefusedSwings,
        clears: Callable,
        has_room: Callable,
        experience: EdgeExperience | None = None,
    ):
        self._experience, self._has_room = experience, has_room
        self._swings = LazySwings(clears, gait.swing_duration)
        self._phases = [np.array(phase, dtype=np.int64) for phase in gait.phases]
        self._standing = [
            np.array([leg for leg in range(4) if config.any_order or leg not in phase], dtype=np.int64)
            for phase in gait.phases
        ]
        self._config = config
        self._model = model
        self._table, self._labels = table, labels
        self._path = path
        self._deadline = deadline
        self._refused, self._things = refused, outlines(refused.appeared, SWING_ROOM)
        self._rate = cost_rate(config)
        turns = np.abs(wrap_angle(np.diff(path[:, 2])))
        legs = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1) + config.yaw_weight * turns
        self._remaining = np.append(np.cumsum(legs[::-1])[::-1], 0.0)
        self._open: list = []
        self._best_cost: dict = {}
        self._children, self._dearer = {}, defaultdict(list)
        self._is_clear, self._postponed, self._swings_of = {}, set(), {}
        self._pushed, self._first = 0, ()
        self.nodes: list[SearchNode] = []

    def run(self, feet, normals, regions, hanging: tuple = ()) -> SearchResult:
        """Searches from the start stance; the result's node is the end of the plan, or -1.

        Feet without ground, ``hanging`` legs, swing first where the gait swings all of them at once.
        """
        p_WB, rpy_WB = base_pose_above(feet, self._model.base_height, self._model.max_tilt)
        to_go = self._way_to_go(p_WB, rpy_WB)
        self._first = tuple(k for k, legs in enumerate(self._phases) if hanging and set(hanging) <= set(legs.tolist()))
        start = Stances(feet[None], normals[None], regions[None], p_WB[None], rpy_WB[None])
        values = np.zeros(1), np.array([to_go]), np.zeros(1), np.array([-1])
        for phase in self._first_phases():
            self._push(*self._nodes(start, np.array([0]), phase, -1, 0, values))
        result, nearest, last_gain = SearchResult(), np.inf, 0
        while self._open:
            estimate, _, _, index, terminal = heapq.heappop(self._open)
            node = self.nodes[index]
            if not terminal and (self._is_passed_over(node) or node.depth == self._config.max_steps):
                continue
            if self._is_postponed(index, estimate, terminal) or not self._can_be_swung_to(index, result):
                continue
            if terminal:
                result.node, result.complete = index, node.arrives
                return result
            if result.expansions >= self._config.max_expansions:
                bound = f"the bound of {self._config.max_expansions} expansions was reached"
                return self._best_effort(result, f"{bound}; {self._dead_end(result)}")
            if node.to_go < nearest - _NEARER:
                nearest, last_gain = node.to_go, result.expansions
            if result.expansions - last_gain > self._config.patience * self._config.max_expansions:
                return self._best_effort(
                    result, f"{result.expansions - last_gain} expansions in vain; {self._dead_end(result)}"
                )
            if work_clock() > self._deadline:
                result.time_limit_hit = True
                return self._best_effort(result, f"the time limit of {self._config.time_limit:g} s was reached")
            result.expansions += 1
            self._expand(index, node, result)
        return self._best_effort(result, self._dead_end(result))

    def _first_phases(self):
        """Phases in which a plan may begin."""
        if self._config.any_order:
            return (0,)
        return self._first or range(len(self._phases) if self._config.any_first_phase else 1)

    def _phases_from(self, node: SearchNode):
        """Phases in which the next swing from a node may be."""
        if not self._config.any_order:
            return (node.phase,)
        return self._first if self._first and node.depth == 0 else range(len(self._phases))

    def stances(self, index: int) -> list[SearchNode]:
        """Returns the nodes from the start to ``index``."""
        chain = []
        while index >= 0:
            chain.append(self.nodes[index])
            index = self.nodes[index].parent
        return chain[::-1]

    def swing_legs(self, node: SearchNode) -> tuple[Leg, ...]:
        """Returns the legs whose swing led to ``node``."""
        return tuple(Leg(int(leg)) for leg in self._phases[node.swung])

    def _expand(self, index: int, node: SearchNode, result: SearchResult):
        """Adds the permitted stances after one swing, the most promising ones."""
        phases = self._phases_from(node)
        *stances, costs, ways, by_labels, swung, refused = expand(
            node.feet, node.normals, node.regions, self._swings_in(phases), node.p_WB, node.rpy_WB,
            self._path, self._remaining, self._table, self._model, self._labels,
        )  # fmt: skip
        result.refused += refused
        result.combinations += len(costs) + int(refused.sum())
        stances = Stances(*stances)
        bad_ground = node.bad_ground + cost_beyond_unseen(by_labels, self._labels.weight)
        self._add_experience(node.feet, stances.feet, swung, costs, bad_ground)
        promise = costs + self._config.heuristic_inflation * self._rate * ways
        self._rule_out(node.feet, stances.feet, swung, promise)
        order = np.argsort(promise, kind="stable")
        order = order[np.isfinite(promise[order])]
        self._children[index] = self._as_nodes(stances, (node.cost + costs, ways, bad_ground, swung), order, index)
        self._push_children(index, self._config.max_children)

    def _swings_in(self, phases) -> np.ndarray:
        """The swings of some phases as ``expand`` takes them."""
        swings = self._swings_of.get(phases)
        if swings is None:
            ends = [(phase, self._phases[phase][0], self._phases[phase][-1]) for phase in phases]
            swings = self._swings_of[phases] = np.array(ends, dtype=np.int64)
        return swings

    def _each_phase(self, swung: np.ndarray):
        """The legs of each phase among ``swung``, and which of the transitions are theirs, a slice."""
        starts = np.flatnonzero(np.diff(swung, prepend=-1)).tolist()
        for start, stop in itertools.pairwise([*starts, len(swung)]):
            yield self._phases[swung[start]], slice(start, stop)

    def _add_experience(self, before: np.ndarray, feet: np.ndarray, swung: np.ndarray, costs, bad_ground):
        """Adds to the costs of transitions what they cost by experience."""
        if self._experience is not None:
            for legs, part in self._each_phase(swung):
                known = self._experience.costs(legs, before, feet[part])
                costs[part] += known
                bad_ground[part] += known

    def _rule_out(self, before: np.ndarray, feet: np.ndarray, swung: np.ndarray, promise):
        """Makes what transitions promise infinite if they are like refused ones or lead over what has appeared."""
        if self._refused.swings or self._things:
            for legs, part in self._each_phase(swung):
                promise[part][are_refused(self._refused.swings, legs, before, feet[part])] = np.inf
                promise[part][lead_over(self._things, legs, before, feet[part])] = np.inf

    def _as_nodes(self, stances: Stances, values: tuple, order: np.ndarray, parent: int):
        """The children of ``parent`` in this order; made as they are asked for."""
        before = self.nodes[parent]
        phase, depth, step = self._next_phase(before), before.depth + 1, self._config.max_children
        for start in range(0, len(order), step):
            yield from self._nodes(stances, order[start : start + step], phase, parent, depth, values)

    def _nodes(self, stances: Stances, rows: np.ndarray, phase: int, parent: int, depth: int, values: tuple) -> list:
        """Nodes of some of the ``stances`` before a phase; ``values`` are of all: costs, ways to go, bad ground, swung."""
        config, (feet, _, regions, p_WB, rpy_WB) = self._config, stances
        found = identities(rows, feet, regions, phase, self._standing[phase], self._table.radii, float(config.single_place))
        arrive, deviations = arrivals(
            rows, feet, p_WB, rpy_WB, self._path[-1], float(config.goal_tolerance), float(config.goal_yaw_tolerance),
            self._model.nominal,
        )  # fmt: skip
        names, width = found.tobytes(), found.itemsize * found.shape[1]
        families = (names[start : start + width] for start in range(0, len(names), width))
        costs, ways, bad_ground, swung = (value[rows].tolist() for value in values)
        each = zip(
            rows.tolist(), costs, ways, families, arrive.tolist(), deviations.tolist(), bad_ground, swung, strict=True
        )  # fmt: skip
        return [
            SearchNode(stances, row, phase, cost, way, parent, depth, family, there, deviation, bad, swing)
            for row, cost, way, family, there, deviation, bad, swing in each
        ]

    def _next_phase(self, node: SearchNode) -> int:
        """The phase of the nodes after one."""
        return 0 if self._config.any_order else (node.phase + 1) % len(self._phases)

    def _push_children(self, index: int, count: int):
        """Queues the next best children of a node, but for those that are known to be out of reach."""
        before, children = self.nodes[index], self._children[index]
        blocked = self._swings.blocked_from(before)
        if blocked:
            legs = self._phases
            children = (child for child in children if self._swings.may_clear(legs[child.swung], before, child, blocked))
        for child in itertools.islice(children, count):
            self._push(child)

    def _is_passed_over(self, node: SearchNode) -> bool:
        """Whether a cheaper way to the node's family is known; if that turns out to be none, it is queued again."""
        if node.cost <= self._best_cost.get(node.family, np.inf):
            return False
        self._dearer[node.family].append(node)
        return True

    def _is_postponed(self, index: int, estimate: float, terminal: bool) -> bool:
        """Queues a stance with stuck feet again, once, as if its way to go were longer."""
        stuck = self._swings.stuck_feet(self.nodes[index])
        if not stuck or (index, terminal) in self._postponed:
            return False
        self._postponed.add((index, terminal))
        longer = stuck * _STUCK_WAY * self._config.heuristic_inflation * self._rate
        self._queue(estimate + longer, self.nodes[index].depth, index, terminal)
        return True

    def _can_be_swung_to(self, index: int, result: SearchResult) -> bool:
        """Whether feet and torso clear the ground on the way to a node; looked at when it is its turn, as few of them are.

        One that cannot be reached makes room for the next best child of its parent, and for the dearer ways to its family.
        """
        node = self.nodes[index]
        if node.parent < 0 or index in self._is_clear:
            return self._is_clear.get(index, True)
        before = self.nodes[node.parent]
        room = self._has_room(node.p_WB, node.rpy_WB)
        clear = self._is_clear[index] = room and self._swings.clear(self._phases[node.swung], before, node)
        if not clear:
            result.refused[BLOCKED if room else NO_ROOM] += 1
            self._push_children(node.parent, 1)
            if self._best_cost.get(node.family) == node.cost:
                del self._best_cost[node.family]
                for other in self._dearer.pop(node.family, ()):
                    self._push(other)
        return clear

    def _push(self, node: SearchNode):
        """Queues a node unless a way at least as cheap to its family is known; and the end of the plan, if it may be one."""
        if node.cost >= self._best_cost.get(node.family, np.inf):
            self._dearer[node.family].append(node)
            return
        self._best_cost[node.family] = node.cost
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

    def _final_cost(self, node: SearchNode) -> float:
        return self._config.final_stance_weight * node.deviation

    def _may_end(self, node: SearchNode) -> bool:
        """A plan ends at the waypoint, or, if that is further than its steps lead, somewhere nearer to it."""
        if node.depth == 0:
            return False
        if self.progress(node) < min(self._config.min_progress, 0.5 * self.nodes[0].to_go):
            return False
        return node.arrives or node.depth == self._config.max_steps

    def progress(self, node: SearchNode) -> float:
        """How much nearer to the waypoint than at the start a node is, along the path [m]."""
        return self.nodes[0].to_go - node.to_go

    def _way_to_go(self, p_WB, rpy_WB) -> float:
        x, y, yaw = p_WB[0], p_WB[1], rpy_WB[2]
        return distance_to_go(x, y, yaw, self._path, self._remaining, self._config.yaw_weight)[0]

    def _best_effort(self, result: SearchResult, reason: str) -> SearchResult:
        """Ends a search that did not arrive: with the stance that is best to wait in, among those with some progress."""
        result.reason = reason
        candidates = [k for k, node in enumerate(self.nodes) if self.progress(node) >= self._config.min_progress]
        candidates.sort(key=lambda k: self._waiting_cost(self.nodes[k]))
        result.node = next((k for k in candidates if self._can_be_swung_to(k, result)), -1)
        return result

    def _waiting_cost(self, node: SearchNode) -> float:
        """How bad it is to come to wait in a stance: the way to go, how it stands there, what it stepped on [m]."""
        return self._rate * node.to_go + self._final_cost(node) + node.bad_ground

    def _dead_end(self, result: SearchResult) -> str:
        """Says in words what kept the search from coming nearer."""
        if result.combinations == 0:
            return "no foothold is within reach of the swinging legs"
        nearest = f"the steps found lead no nearer than {min(node.to_go for node in self.nodes):.2f} m to the waypoint"
        if not result.refused.any():
            return nearest
        worst = int(np.argmax(result.refused))
        share = 100.0 * result.refused[worst] / result.combinations
        return f"{nearest} ({share:.0f} % of {result.combinations} stances refused: {REJECTIONS[worst]})"
