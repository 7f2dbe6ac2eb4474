"""A* on the lattice of torso positions and yaws."""

import heapq

import numpy as np
from numba import njit

from quadpips_drake.math.angles import wrap_angle


@njit(cache=True)
def _edge_cost(step, turn, yaw, penalty, yaw_weight, heading_weight):
    """Cost of an edge that moves by ``step`` (3,) and turns by ``turn`` to ``yaw``; see ``search_lattice``."""
    length = np.sqrt(np.sum(step * step))
    factor = 1.0 + penalty
    if np.hypot(step[0], step[1]) > 1e-6:
        factor += heading_weight * 0.5 * (1.0 - np.cos(np.arctan2(step[1], step[0]) - yaw))
    return length * factor + yaw_weight * turn


@njit(cache=True)
def search_lattice(
    positions, yaws, penalty, offsets, neighbours, start_yaw, goal, goal_yaw,
    goal_yaw_weight, yaw_weight, max_edge_yaw, heading_weight, max_expansions,
):  # fmt: skip
    """Searches from position 0 to position ``goal``.

    An edge to the pose (p', yaw') costs |p' - p| (1 + penalty' + heading_weight (1 - cos(direction - yaw')) / 2)
    + yaw_weight |yaw' - yaw|; the cost-to-go is the distance to the goal plus ``goal_yaw_weight`` times the yaw that lacks
    to ``goal_yaw`` (the weight is 0 when the final yaw is free). It is a lower bound and consistent.

    Args:
        positions: (n, 3); yaws: (m,); penalty: (n, m), inf for poses that are not allowed.
        offsets, neighbours: graph over the positions in compressed rows; pairs of a position with itself turn in place.
        start_yaw: index of the yaw at the start.

    Returns:
        parent (n m,) of each pose index * m + yaw index, -1 for none; whether it was expanded, (n m,); the pose that was
        found, or -1.
    """
    n, m = penalty.shape
    parent = np.full(n * m, -1, dtype=np.int64)
    cost = np.full(n * m, np.inf)
    closed = np.zeros(n * m, dtype=np.bool_)
    cost[start_yaw] = 0.0
    queue = [(0.0, np.int64(start_yaw))]
    expansions = 0
    while len(queue) > 0:
        _, node = heapq.heappop(queue)
        if closed[node]:
            continue
        i, k = node // m, node % m
        if i == goal and (goal_yaw_weight == 0.0 or abs(wrap_angle(yaws[k] - goal_yaw)) <= np.pi / m):
            return parent, closed, node
        if expansions >= max_expansions:
            break
        closed[node] = True
        expansions += 1
        for edge in range(offsets[i], offsets[i + 1]):
            j = neighbours[edge]
            step = positions[j] - positions[i]
            rest = np.sqrt(np.sum((positions[goal] - positions[j]) ** 2))
            for other in range(m):
                turn = abs(wrap_angle(yaws[other] - yaws[k]))
                if turn > max_edge_yaw or not np.isfinite(penalty[j, other]) or (j == i and other == k):
                    continue
                new_cost = cost[node] + _edge_cost(step, turn, yaws[other], penalty[j, other], yaw_weight, heading_weight)
                child = j * m + other
                if new_cost < cost[child] - 1e-12 and not closed[child]:
                    cost[child] = new_cost
                    parent[child] = node
                    missing = goal_yaw_weight * abs(wrap_angle(yaws[other] - goal_yaw))
                    heapq.heappush(queue, (new_cost + rest + missing, np.int64(child)))
    return parent, closed, np.int64(-1)
