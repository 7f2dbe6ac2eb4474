"""Which gap keeps the robot from its goal, and how wide it is."""

import cv2
import numpy as np

from quadpips_drake.planning.torso.support_map import SupportMap


def _joined(near: np.ndarray, seeds: np.ndarray, goal: tuple[int, int]) -> np.ndarray | None:
    """Returns the cells (rows, columns) of ``near`` joined with a seed, or None if the goal is among them."""
    _, labels = cv2.connectedComponents(near.astype(np.uint8), connectivity=8)
    reached = np.isin(labels, np.unique(labels[seeds & near])) & near
    return None if reached[goal] else reached


def widest_gap(support: SupportMap, positions: np.ndarray, goal_xy) -> tuple[float, np.ndarray] | None:
    """Returns width [m] and middle (2,) of the widest gap on the best way from ``positions`` (n, 3) to the goal.

    The best way is the one whose widest gap between steppable ground is least. None if there is no ground near the goal, or
    no gap on the way to it.
    """
    ix, iy, inside = support.cells(np.asarray(goal_xy, dtype=float))
    own_ix, own_iy, own_inside = support.cells(positions[:, :2])
    if not inside or support.distance[iy, ix] > 0.5:
        return None
    goal = int(support.nearest[0, iy, ix]), int(support.nearest[1, iy, ix])
    seeds = np.zeros(support.distance.shape, dtype=bool)
    rows, columns = support.nearest[:, own_iy[own_inside], own_ix[own_inside]]
    seeds[rows, columns] = True
    low, high, reached = 0.0, float(support.distance.max()) + support.resolution, None
    while high - low > 0.5 * support.resolution:
        middle = 0.5 * (low + high)
        found = _joined(support.distance <= middle, seeds, goal)
        if found is None:
            high = middle
        else:
            low, reached = middle, found
    if reached is None or low < support.resolution:
        return None
    bridge = cv2.dilate(reached.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & ~reached
    bridge &= support.distance <= high + support.resolution
    cells = np.argwhere(bridge)
    if not len(cells):
        return None
    points = support.origin + support.resolution * cells[:, ::-1]
    nearest = points[np.argmin(np.hypot(*(points - goal_xy).T))]
    return 2.0 * high, nearest
