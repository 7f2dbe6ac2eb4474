"""Whether a way leads to the goal on the true terrain, and what stands in it: ground that one step connects, from above."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from quadpips_drake.terrain.terrain import GOAL_TOLERANCE, Terrain
from quadpips_drake.terrain.truth import GroundTruth

_CELL = 0.05
_MARGIN = 3.0
"""So far around start and goal a way is looked for [m]."""
_MOST_CELLS = 250_000
_AHEAD = 0.6
"""What stands in the way is looked for so far beyond the last place that can be reached [m]."""
_BACK = 1.0
"""... and so far before it is where a gap may begin [m]."""
_WALL = 0.05
"""What rises so far above the ground beside it and carries no foot is a wall [m]."""


@dataclass(frozen=True)
class Obstacle:
    """What separates a place from the goal."""

    kind: str
    """"wall", "gap" or "step"."""
    size: float
    """Height of a wall or a step, width of a gap [m]."""
    place: tuple[float, float]
    """Where it begins [m]."""
    appeared: int | None = None
    """Number of the element that has appeared there; None for what was there from the beginning."""


def obstacle_before(
    terrain: Terrain,
    place: np.ndarray,
    *,
    step: float,
    gap: float,
    half_width: float,
    appeared: tuple[np.ndarray, np.ndarray] | None = None,
) -> Obstacle | None:
    """Returns what separates ``place`` (2,) from the terrain's goal; None where a way leads there, or it cannot be said.

    Args:
        terrain: as it was at the beginning.
        place: where the robot is, x, y [m].
        step: highest step up or down [m].
        gap: widest gap that a leg steps over [m].
        half_width: the robot passes between walls that are twice this apart [m].
        appeared: least and largest x, y, z of what has appeared since, (n, 3) each [m].
    """
    x, y = _grid(np.array([place, terrain.goal, terrain.start[:2]]))
    if x.size > _MOST_CELLS:
        return None
    truth = GroundTruth(terrain)
    ground, top = truth.height(x, y, walkable_only=True), truth.height(x, y)
    element = truth.element(x, y)
    walkable = np.array([e.is_walkable for e in terrain.elements] + [False])[element]
    near = distance_transform_edt(~walkable, return_distances=False, return_indices=True)
    beside = ground[tuple(near)]
    wall = ~walkable & (np.nan_to_num(top, nan=-np.inf) > beside + _WALL)
    number = np.full(x.shape, -1)
    for k, (low, high) in enumerate(zip(*appeared, strict=True) if appeared is not None else ()):
        inside = (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1]) & (high[2] > beside + _WALL)
        wall |= inside
        number[inside] = k
        top = np.where(inside, np.fmax(top, high[2]), top)
    footing = walkable & ~wall
    if not footing.any():
        return None
    distance, nearest = distance_transform_edt(~footing, sampling=_CELL, return_indices=True)
    height = np.where(footing, ground, ground[tuple(nearest)])
    passable = (distance <= 0.5 * gap) & ~wall
    if wall.any():
        passable &= distance_transform_edt(~wall, sampling=_CELL) > half_width
    labels = _connected(passable, height, step)
    mine = _label_near(labels, passable, x, y, place, reach=0.6)
    goals = labels[(np.hypot(x - terrain.goal[0], y - terrain.goal[1]) <= GOAL_TOLERANCE) & passable]
    if mine < 0 or (goals == mine).any():
        return None
    return _what_separates(labels == mine, x, y, place, terrain.goal, (wall, number, footing, height, top), step)


def _grid(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
    return np.meshgrid(np.arange(low[0], high[0], _CELL), np.arange(low[1], high[1], _CELL))


def _connected(passable: np.ndarray, height: np.ndarray, step: float) -> np.ndarray:
    """Number of the connected part of each cell; neighbours are connected unless a step between them is too high."""
    numbers = np.arange(passable.size).reshape(passable.shape)
    pairs = []
    for one, other in (((slice(None), slice(1, None)), (slice(None), slice(-1))), ((slice(1, None),), (slice(-1),))):
        joined = passable[one] & passable[other] & (np.abs(height[one] - height[other]) <= step)
        pairs.append((numbers[one][joined], numbers[other][joined]))
    rows, columns = (np.concatenate(side) for side in zip(*pairs, strict=True))
    graph = coo_matrix((np.ones(len(rows), np.int8), (rows, columns)), shape=(passable.size, passable.size))
    return connected_components(graph, directed=False)[1].reshape(passable.shape)


def _label_near(labels, passable, x, y, place, *, reach: float) -> int:
    """The part that the nearest passable cell belongs to; -1 where there is none within ``reach`` [m]."""
    distances = np.where(passable, np.hypot(x - place[0], y - place[1]), np.inf)
    k = int(distances.argmin())
    return int(labels.ravel()[k]) if distances.ravel()[k] <= reach else -1


def _what_separates(mine: np.ndarray, x, y, place, goal, layers, step: float) -> Obstacle:
    """What comes first on the straight way from the place in reach that is nearest to the goal; of several, to the robot."""
    wall, number, footing, height, top = layers
    rows, columns = np.nonzero(mine)
    to_goal = np.hypot(x[rows, columns] - goal[0], y[rows, columns] - goal[1])
    to_robot = np.hypot(x[rows, columns] - place[0], y[rows, columns] - place[1])
    nearest = int(np.where(to_goal <= to_goal.min() + _CELL, to_robot, np.inf).argmin())
    begin = np.array([x[rows[nearest], columns[nearest]], y[rows[nearest], columns[nearest]]])
    there = np.asarray(goal, float) - begin
    length = max(float(np.hypot(*there)), _CELL)
    ways = np.arange(-_BACK, min(length, 2.0) + _CELL, 0.5 * _CELL)
    along = begin + ways[:, None] * there / length
    cells = (
        np.clip(np.round((along[:, 1] - y[0, 0]) / _CELL).astype(int), 0, x.shape[0] - 1),
        np.clip(np.round((along[:, 0] - x[0, 0]) / _CELL).astype(int), 0, x.shape[1] - 1),
    )
    here = (float(begin[0]), float(begin[1]))
    ahead = (ways >= 0.0) & (ways <= _AHEAD)
    walls = np.flatnonzero(wall[cells] & ahead)
    voids = np.flatnonzero(~footing[cells] & ~wall[cells] & ahead)
    if len(walls) and not (len(voids) and voids[0] < walls[0] - 8):
        k = (cells[0][walls[0]], cells[1][walls[0]])
        rise = float(np.nan_to_num(top[k] - height[k]))
        return Obstacle("wall", rise, here, int(number[k]) if number[k] >= 0 else None)
    if len(voids):
        ground = footing[cells]
        last, then = np.flatnonzero(ground[: voids[0]]), np.flatnonzero(ground[voids[0] :])
        count = (voids[0] + then[0] if len(then) else len(ground)) - (last[-1] + 1 if len(last) else 0)
        return Obstacle("gap", float(0.5 * _CELL * count), here)
    rises = np.abs(np.diff(height[cells]))[ahead[1:]]
    return Obstacle("step", float(np.nanmax(rises, initial=0.0)), here)
