"""A* on the lattice of torso positions and yaws."""

import heapq
from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.planning.torso.support_map import mean_miss

_SAMPLES = 0.08
"""The way along an edge is looked at in steps of this [m]."""


@njit(cache=True)
def _turns(yaws):
    """|yaw_j - yaw_i|, (m, m)."""
    turns = np.empty((len(yaws), len(yaws)))
    for i in range(len(yaws)):
        for j in range(len(yaws)):
            turns[i, j] = abs(wrap_angle(yaws[j] - yaws[i]))
    return turns


@njit(cache=True)
def _distance(positions, i, j):
    x, y, z = positions[j, 0] - positions[i, 0], positions[j, 1] - positions[i, 1], positions[j, 2] - positions[i, 2]
    return np.sqrt(x * x + y * y + z * z)


class Ground(NamedTuple):
    """What decides whether a stance exists on the way from pose to pose; a NamedTuple, so that numba takes it as it is."""

    distance: np.ndarray
    height: np.ndarray
    origin: np.ndarray
    resolution: float
    """Of the SupportMap."""
    places: np.ndarray
    """Where each leg may find ground, see ``places_of_legs``."""
    max_height_difference: float
    base_height: float
    bridge_cost: float
    """What an edge costs more on which some leg finds no ground [m]; 0: nobody looks."""


@njit(cache=True)
def _direction(positions, i, j):
    """Direction from i to j in xy (as it is if they are one above the other), and whether they are not."""
    x, y = positions[j, 0] - positions[i, 0], positions[j, 1] - positions[i, 1]
    way = np.hypot(x, y)
    return (x / way, y / way, True) if way > 1e-6 else (x, y, False)


@njit(cache=True, nogil=True)
def _has_stances(positions, i, j, yaw, ground):
    """Whether all legs find ground all along the edge from i to j, its ends left out."""
    way = np.hypot(positions[j, 0] - positions[i, 0], positions[j, 1] - positions[i, 1])
    count = int(way / _SAMPLES)
    for k in range(1, count + 1):
        a = k / (count + 1)
        x, y = (1.0 - a) * positions[i, 0] + a * positions[j, 0], (1.0 - a) * positions[i, 1] + a * positions[j, 1]
        below = (1.0 - a) * positions[i, 2] + a * positions[j, 2] - ground.base_height
        miss = mean_miss(
            ground.distance, ground.height, ground.origin, ground.resolution, x, y, yaw, below, ground.places,
            ground.max_height_difference, 0.0,
        )  # fmt: skip
        if not np.isfinite(miss):
            return False
    return True


@njit(cache=True, nogil=True)
def _bridge_cost(positions, i, j, edge, k, yaws, ground, seen):
    """Returns what ``edge`` from i to j with yaw k costs more.

    ``seen`` remembers, (edges, m): 0 not looked at, 1 stances all along, 2 a gap.
    """
    if ground.bridge_cost <= 0.0:
        return 0.0
    if seen[edge, k] == 0:
        seen[edge, k] = 1 if _has_stances(positions, i, j, yaws[k], ground) else 2
    return ground.bridge_cost if seen[edge, k] == 2 else 0.0


@njit(cache=True, nogil=True)
def search_lattice(
    positions, yaws, penalty, offsets, neighbours, ground, start_yaw, goal, yaw_weight, max_edge_yaw, heading_weight,
    max_expansions,
):  # fmt: skip
    """Searches from position 0 to position ``goal``; to all poses in reach if that is -1.

    An edge to the pose (p', yaw') costs |p' - p| (1 + penalty' + heading_weight (1 - cos(direction - yaw')) / 2)
    + yaw_weight |yaw' - yaw|, and ``ground.bridge_cost`` if some leg has no ground between its ends; the cost-to-go is the
    distance to the goal, a lower bound and consistent.

    Args:
        positions: (n, 3); yaws: (m,); penalty: (n, m), inf for poses that are not allowed.
        offsets, neighbours: graph over the positions in compressed rows; pairs of a position with itself turn in place.
        ground: Ground; start_yaw: index of the yaw at the start.

    Returns:
        parent (n m,) of each pose index * m + yaw index, -1 for none; whether it was expanded, (n m,); the cost of the way
        to it, (n m,); the pose that was found, or -1.
    """
    n, m = penalty.shape
    parent = np.full(n * m, -1, dtype=np.int64)
    cost = np.full(n * m, np.inf)
    closed = np.zeros(n * m, dtype=np.bool_)
    cost[start_yaw] = 0.0
    queue = [(0.0, np.int64(start_yaw))]
    expansions = 0
    seen = np.zeros((len(neighbours), m), dtype=np.int8)
    turns, ahead_x, ahead_y = _turns(yaws), np.cos(yaws), np.sin(yaws)
    while len(queue) > 0:
        _, node = heapq.heappop(queue)
        if closed[node]:
            continue
        i, k = node // m, node % m
        if i == goal:
            return parent, closed, cost, node
        if expansions >= max_expansions:
            break
        closed[node] = True
        expansions += 1
        for edge in range(offsets[i], offsets[i + 1]):
            j = neighbours[edge]
            length = _distance(positions, i, j)
            rest = _distance(positions, j, goal) if goal >= 0 else 0.0
            x, y, moves = _direction(positions, i, j)
            for other in range(m):
                child, turn = j * m + other, turns[k, other]
                if turn > max_edge_yaw or closed[child] or not np.isfinite(penalty[j, other]):
                    continue
                factor = 1.0 + penalty[j, other]
                if moves:
                    factor += heading_weight * 0.5 * (1.0 - x * ahead_x[other] - y * ahead_y[other])
                new_cost = cost[node] + (length * factor + yaw_weight * turn)
                if new_cost < cost[child] - 1e-12 and penalty[i, k] + penalty[j, other] > 0.0:  # else no gap is between
                    new_cost += _bridge_cost(positions, i, j, edge, other, yaws, ground, seen)
                if new_cost < cost[child] - 1e-12:
                    cost[child] = new_cost
                    parent[child] = node
                    heapq.heappush(queue, (new_cost + rest, np.int64(child)))
    return parent, closed, cost, np.int64(-1)
