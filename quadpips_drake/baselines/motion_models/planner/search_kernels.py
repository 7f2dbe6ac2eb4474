"""Algorithm 1 of Taouil et al. on arrays: best-first search over velocity commands, compiled.

A node is the robot at an exchange of the feet; its row of numbers is laid out by the slices below, in the plane, with the
base's heading as it was measured. ``tests/baselines/motion_models/planner/search_twin.py`` says the same slowly.
"""

import heapq
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numba.typed import Dict

from quadpips_drake.baselines.motion_models.state import (
    BASE_SHIFT,
    COMMAND,
    CONSTANT,
    FEET,
    FEET_SHIFT,
    INPUTS,
    NEXT_VELOCITY,
    OUTPUTS,
    PREVIOUS_COMMAND,
    PREVIOUS_VELOCITY,
    TURN,
    VELOCITY,
)

NODE_POSITION, NODE_VELOCITY, NODE_PREVIOUS_VELOCITY = slice(0, 2), slice(2, 4), slice(4, 6)
NODE_COMMAND = slice(6, 8)
"""Forward, left command of the step that led here [m/s]."""
NODE_FEET, NODE_HEIGHTS = slice(8, 16), slice(16, 20)
"""x, y of the feet LF, RF, LH, RH from the base's origin in B, and heights of the ground below them in W [m]."""
NODE_SIZE = 20

FOUND, AT_GOAL, EXHAUSTED, LIMIT = 0, 1, 2, 3
"""How a search ends: with a plan over the whole horizon, with one that ends at the goal, with every way pruned, or with too
many expansions."""
NO_ACTION = 255
MAX_HORIZON, MAX_ACTIONS = 63, 255
"""What the numbers of nodes have room for."""

_P, _V, _PV, _C, _F, _Z = (
    part.start for part in (NODE_POSITION, NODE_VELOCITY, NODE_PREVIOUS_VELOCITY, NODE_COMMAND, NODE_FEET, NODE_HEIGHTS)
)
_IN_V, _IN_PV, _IN_C, _IN_PC = VELOCITY.start, PREVIOUS_VELOCITY.start, COMMAND.start, PREVIOUS_COMMAND.start
_IN_F, _IN_T = FEET.start, TURN.start
_OUT_B, _OUT_F, _OUT_V = BASE_SHIFT.start, FEET_SHIFT.start, NEXT_VELOCITY.start
_OFFSET = 32768


class Walk(NamedTuple):
    """What is known of the walk; NamedTuples, so that numba takes them as they are."""

    coefficients: np.ndarray
    """Of MotionModels, (2, OUTPUTS, INPUTS)."""
    acceleration: float
    """A walk that is known to take up commands no faster than this [m/s^2]; infinite: the coefficients say it all."""
    step_duration: float
    """From one exchange to the next [s]."""
    turns: np.ndarray
    """Inputs TURN of the first step and of all later ones, (2, 4)."""
    heading: np.ndarray
    """Cosine and sine of the base's yaw in W, (2,)."""


class Map(NamedTuple):
    """The foot costmap."""

    height: np.ndarray
    distance: np.ndarray
    corner: np.ndarray
    cell: float


class Rules(NamedTuple):
    """What is wanted, and what is allowed."""

    actions: np.ndarray
    """Forward command, and left one beside the hold's [m/s], (m, 2)."""
    horizon: int
    """Steps of a plan."""
    clearance: np.ndarray
    """Least distance of the fore and of the hind swing foot to unsafe cells, by step [m], (horizon, 2)."""
    max_height_change: float
    margin: float
    """Below this distance to unsafe cells a foothold costs [m]."""
    clearance_weight: float
    preferred_speed: float
    speed_weight: float
    goal: np.ndarray
    """x, y in W [m], (2,)."""
    goal_tolerance: float
    line: np.ndarray
    """x, y of a point of the line that is kept to, and of its unit normal, to the left, in W, (4,)."""
    hold_gain: float
    """Left command per metre that the base is to the right of the line [1/s]."""
    hold_limit: float
    """Largest such command [m/s]."""
    resolution: float
    """Positions of the base closer than this are one [m]."""
    accumulate: bool
    """Whether costs add up along a plan; the paper looks at the last node alone."""
    max_expansions: int


@njit(cache=True, nogil=True, error_model="numpy")
def _clipped(value, limit):
    return min(max(value, -limit), limit)


@njit(cache=True, nogil=True, error_model="numpy")
def left_command(x, y, action_left, rules):
    """Left command [m/s] of an action at x, y: what the action asks for, and back to the line."""
    line = rules.line
    offset = (x - line[0]) * line[2] + (y - line[1]) * line[3]
    return action_left + _clipped(-rules.hold_gain * offset, rules.hold_limit)


@njit(cache=True, nogil=True, error_model="numpy")
def predict_step(node, swing, first, forward, left, walk, child):
    """Writes the row of the next node: equations (2) to (5) for the command ``forward``, ``left`` [m/s].

    ``first``: whether it is the first step of a plan. Heights of the feet stay as they are.
    """
    x, y, ramp = np.empty(INPUTS), np.empty(OUTPUTS), np.zeros(2)
    for k in range(2):
        command = forward if k == 0 else left
        change = command - node[_V + k]
        if walk.acceleration < np.inf:
            change = _clipped(change, walk.acceleration * walk.step_duration)
            command = node[_V + k] + change
            ramp[k] = -change * abs(change) / (2.0 * walk.acceleration)
        x[_IN_V + k], x[_IN_PV + k] = node[_V + k], node[_PV + k]
        x[_IN_C + k], x[_IN_PC + k] = command, node[_C + k]
    for k in range(8):
        x[_IN_F + k] = node[_F + k]
    x[CONSTANT] = 1.0
    for k in range(4):
        x[_IN_T + k] = walk.turns[0 if first else 1, k]
    for row in range(OUTPUTS):
        total = 0.0
        for column in range(INPUTS):
            total += walk.coefficients[swing, row, column] * x[column]
        y[row] = total
    shift_x, shift_y = y[_OUT_B] + ramp[0], y[_OUT_B + 1] + ramp[1]
    cos, sin = walk.heading[0], walk.heading[1]
    child[_P] = node[_P] + (cos * shift_x - sin * shift_y)
    child[_P + 1] = node[_P + 1] + (sin * shift_x + cos * shift_y)
    child[_V], child[_V + 1] = y[_OUT_V], y[_OUT_V + 1]
    child[_PV], child[_PV + 1] = node[_V], node[_V + 1]
    child[_C], child[_C + 1] = forward, left
    for leg in range(4):
        child[_F + 2 * leg] = node[_F + 2 * leg] - shift_x
        child[_F + 2 * leg + 1] = node[_F + 2 * leg + 1] - shift_y
        child[_Z + leg] = node[_Z + leg]
    for foot in range(2):
        leg = swing_leg(swing, foot)
        child[_F + 2 * leg] += y[_OUT_F + 2 * foot] + ramp[0]
        child[_F + 2 * leg + 1] += y[_OUT_F + 2 * foot + 1] + ramp[1]


@njit(cache=True, nogil=True, error_model="numpy")
def swing_leg(swing, foot):
    """The leg that is the fore (0) or hind (1) one of PAIRS[swing]."""
    return swing if foot == 0 else 3 - swing


@njit(cache=True, nogil=True, error_model="numpy")
def land(child, swing, walk, ground, max_height_change, distances):
    """Puts the swing feet of a new node on the ground; writes their distances to unsafe cells [m] into ``distances`` (2,).

    A distance is 0 where no foot may come down: on unsafe ground, off the map, or too far up or down.
    """
    cos, sin = walk.heading[0], walk.heading[1]
    for foot in range(2):
        leg = swing_leg(swing, foot)
        bx, by = child[_F + 2 * leg], child[_F + 2 * leg + 1]
        i = int(np.floor((child[_P] + (cos * bx - sin * by) - ground.corner[0]) / ground.cell))
        j = int(np.floor((child[_P + 1] + (sin * bx + cos * by) - ground.corner[1]) / ground.cell))
        distances[foot] = 0.0
        if 0 <= i < ground.height.shape[0] and 0 <= j < ground.height.shape[1]:
            height = ground.height[i, j]
            if ground.distance[i, j] > 0.0 and abs(height - child[_Z + leg]) <= max_height_change:
                distances[foot] = ground.distance[i, j]
                child[_Z + leg] = height


@njit(cache=True, nogil=True, error_model="numpy")
def node_cost(child, action_forward, action_left, distances, rules):
    """d_goal + d_foot + preferred speed."""
    x, y = rules.goal[0] - child[_P], rules.goal[1] - child[_P + 1]
    cost = np.sqrt(x * x + y * y)
    for foot in range(2):
        if distances[foot] < rules.margin:
            cost += rules.clearance_weight * (rules.margin - distances[foot])
    off = action_forward - rules.preferred_speed
    return cost + rules.speed_weight * (off * off + action_left * action_left)


@njit(cache=True, nogil=True, error_model="numpy")
def _place(node, start, swing, depth, resolution):
    """A number for a node's discretised position, swing and depth."""
    i = int(np.floor((node[_P] - start[_P]) / resolution + 0.5)) + _OFFSET
    j = int(np.floor((node[_P + 1] - start[_P + 1]) / resolution + 0.5)) + _OFFSET
    return ((i * (2 * _OFFSET) + j) * 2 + swing) * 64 + depth


@njit(cache=True, nogil=True, error_model="numpy")
def _is_at_goal(node, rules):
    x, y = rules.goal[0] - node[_P], rules.goal[1] - node[_P + 1]
    return x * x + y * y <= rules.goal_tolerance * rules.goal_tolerance


class _Tree(NamedTuple):
    """All nodes that were made."""

    rows: np.ndarray
    distances: np.ndarray
    """Of the swing feet to unsafe cells [m], (n, 2)."""
    cost: np.ndarray
    depth: np.ndarray
    parent: np.ndarray
    action: np.ndarray
    """That led there."""
    replaced: np.ndarray
    """Whether a cheaper one took its place in the queue."""


@njit(cache=True, nogil=True)
def search_commands(start, start_swing, walk, ground, rules):
    """Searches for commands whose steps all end on safe ground.

    Args:
        start: row of the node where it begins, (NODE_SIZE,); start_swing: the pair that swings next.
        walk: Walk; ground: Map; rules: Rules.

    Returns:
        How it ended; expansions; and along the plan, the start first: rows (n + 1, NODE_SIZE), actions (n + 1,), costs
        (n + 1,), distances of the swing feet to unsafe cells (n + 1, 2). Without a plan: along the way that led furthest.
    """
    size = 1 + len(rules.actions) * rules.max_expansions
    tree = _Tree(
        np.empty((size, NODE_SIZE)), np.zeros((size, 2)), np.zeros(size), np.zeros(size, np.int64),
        np.full(size, -1), np.full(size, NO_ACTION), np.zeros(size, np.bool_),
    )  # fmt: skip
    tree.rows[0] = start
    opened, visited = Dict.empty(types.int64, types.int64), Dict.empty(types.int64, types.boolean)
    opened[_place(start, start, start_swing, 0, rules.resolution)] = 0
    queue = [(0.0, np.int64(0))]
    used, expansions, end = 1, 0, EXHAUSTED
    while len(queue) > 0:
        _, node = heapq.heappop(queue)
        if tree.replaced[node]:
            continue
        swing, depth = (start_swing + tree.depth[node]) % 2, tree.depth[node]
        place = _place(tree.rows[node], start, swing, depth, rules.resolution)
        if place in opened and opened[place] == node:
            del opened[place]
        if depth == rules.horizon or (node > 0 and _is_at_goal(tree.rows[node], rules)):
            return (FOUND if depth == rules.horizon else AT_GOAL, expansions, *_way_to(node, tree))
        if place * 256 + tree.action[node] in visited:
            continue
        if expansions >= rules.max_expansions:
            end = LIMIT
            break
        visited[place * 256 + tree.action[node]] = True
        expansions += 1
        used = _expand(node, swing, tree, used, opened, visited, queue, walk, ground, rules)
    furthest = 0
    for node in range(used):
        deeper = tree.depth[node] - tree.depth[furthest]
        if deeper > 0 or (deeper == 0 and tree.cost[node] < tree.cost[furthest]):
            furthest = node
    return (end, expansions, *_way_to(furthest, tree))


@njit(cache=True, nogil=True)
def _expand(node, swing, tree, used, opened, visited, queue, walk, ground, rules):
    """Adds the safe children of a node that are no duplicates of cheaper ones; returns how many nodes there are then."""
    parent, depth = tree.rows[node], tree.depth[node]
    least, start = rules.clearance[depth], tree.rows[0]
    for k in range(len(rules.actions)):
        child, forward, more = used, rules.actions[k, 0], rules.actions[k, 1]
        row, distances = tree.rows[child], tree.distances[child]
        left = left_command(parent[_P], parent[_P + 1], more, rules)
        predict_step(parent, swing, node == 0, forward, left, walk, row)
        land(row, swing, walk, ground, rules.max_height_change, distances)
        if not (min(distances[0], distances[1]) > 0.0 and distances[0] >= least[0] and distances[1] >= least[1]):
            continue
        price = node_cost(row, forward, more, distances, rules) + (tree.cost[node] if rules.accumulate else 0.0)
        place = _place(row, start, 1 - swing, depth + 1, rules.resolution)
        if place * 256 + k in visited:
            continue
        if place in opened:
            rival = opened[place]
            if tree.cost[rival] <= price:
                continue
            tree.replaced[rival] = True
        tree.cost[child], tree.depth[child], tree.parent[child], tree.action[child] = price, depth + 1, node, k
        opened[place] = child
        heapq.heappush(queue, (price, np.int64(child)))
        used += 1
    return used


@njit(cache=True, nogil=True)
def _way_to(node, tree):
    """Rows, actions, costs and distances along the way to a node, the start first."""
    way = np.empty(tree.depth[node] + 1, np.int64)
    for k in range(len(way) - 1, -1, -1):
        way[k] = node
        node = tree.parent[node]
    return tree.rows[way], tree.action[way], tree.cost[way], tree.distances[way]


@njit(cache=True, nogil=True)
def clearest_step(start, swing, walk, ground, rules):
    """The action whose next footholds are furthest from unsafe cells, and that distance [m]; 0 if none of them is safe.

    Of equally clear ones the one nearest to the preferred speed.
    """
    child, distances = np.empty(NODE_SIZE), np.zeros(2)
    best, clearest, nearest = 0, -1.0, np.inf
    for k in range(len(rules.actions)):
        forward, more = rules.actions[k, 0], rules.actions[k, 1]
        left = left_command(start[_P], start[_P + 1], more, rules)
        predict_step(start, swing, True, forward, left, walk, child)
        land(child, swing, walk, ground, rules.max_height_change, distances)
        least, off = min(distances[0], distances[1]), abs(forward - rules.preferred_speed) + abs(more)
        if least > clearest or (least == clearest and off < nearest):
            best, clearest, nearest = k, least, off
    return best, clearest
