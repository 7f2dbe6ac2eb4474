"""Whether the torso of a pose has room above what stands on the ground: walls, and things too high to be stepped over."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numba import njit

from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.robots.leg_shapes import place_capsules
from quadpips_drake.robots.reachability import leg_chains
from quadpips_drake.sensing.robot_shapes import trunk_corners
from quadpips_drake.values.regions import GroundHeights

_STEP = 0.04
"""Between points under the torso [m]: of a wall a camera shows the face alone, one cell of the raster thick."""
_LEAST_POINTS = 2
"""So many of them must be too high: one alone may be noise."""
_WORTH_A_LOOK = 0.5
"""Ground that is not even so much of the belly's height above the ground under the base is no obstacle [1]."""
_BORDER = 0.8
"""How far obstacles may be from a pose that they are in the way of [m]: more than half a torso and its margin."""
_UNSEEN = 0.5
"""What was not seen so near to something high is taken to be as high [m]: a camera sees but a part of a wall beside it."""


@lru_cache(maxsize=32)
def body_corners(robot) -> np.ndarray:
    """Opposite corners of the box around a RobotModel's torso that is as wide as the thighs of its nominal stance, (2, 3)
    in B [m]."""
    trunk = trunk_corners(robot)
    corners, chains, shapes = np.array([trunk.min(axis=0), trunk.max(axis=0)]), leg_chains(robot), robot.leg_shapes
    capsules = np.empty((len(shapes.radii[0]), 2, 3))
    for leg in range(4):
        place_capsules(leg, *robot.nominal_footholds_B[leg], chains, shapes, capsules)
        for link, radius, ends in zip(shapes.links[leg], shapes.radii[leg], capsules, strict=True):
            if link == 0 and radius > 0.0:
                corners[0, 1] = min(corners[0, 1], ends[:, 1].min() - radius)
                corners[1, 1] = max(corners[1, 1], ends[:, 1].max() + radius)
    return corners


@dataclass(frozen=True)
class Torso:
    """The lower side of a robot's torso and what is beside it, above level ground in its nominal pose."""

    points: np.ndarray
    """Points on it, x, y in the frame of the base's yaw [m], (n, 2)."""
    fore: float
    """How far before the base its fore feet stand [m] ..."""
    hind: float
    """... and its hind feet, negative [m]."""
    belly: float
    """Its height above the ground [m]."""


@lru_cache(maxsize=32)
def torso_of(robot, margin: float = 0.0) -> Torso:
    """The Torso of a RobotModel, with ``margin`` [m] all round."""
    low, high = body_corners(robot)
    sides = zip(low[:2] - margin, high[:2] + margin, strict=True)
    axes = [np.linspace(a, b, int(np.ceil((b - a) / _STEP)) + 1) for a, b in sides]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    along = np.asarray(robot.nominal_footholds_B)[:, 0]
    fore, hind = float(along[:2].mean()), float(along[2:].mean())
    return Torso(points, fore, hind, float(robot.nominal_base_height + low[2]))


@dataclass(frozen=True)
class HighGround:
    """The highest surfaces on the raster of a SupportMap."""

    top: np.ndarray
    """Highest surface in each cell [m], indexed [iy, ix], see ``_with_unseen``; -inf where nothing is known about it."""
    around: np.ndarray
    """... within _BORDER of it."""

    @staticmethod
    def over(heights: GroundHeights, origin: np.ndarray, resolution: float, shape: tuple) -> "HighGround | None":
        """Of a map, over a raster; None if they have nothing in common.

        Args: the map; middle of the raster's cell (0, 0), (2,), and side of its cells [m]; its rows and columns.
        """
        if not heights.height.size:
            return None
        middles = [heights.corner[i] + heights.cell * (np.arange(heights.height.shape[i]) + 0.5) for i in range(2)]
        cells = [np.rint((middles[i] - origin[i]) / resolution).astype(int) for i in range(2)]
        inside = [np.flatnonzero((cells[i] >= 0) & (cells[i] < shape[1 - i])) for i in range(2)]
        if not len(inside[0]) or not len(inside[1]):
            return None
        part = heights.height[inside[0][0] : inside[0][-1] + 1, inside[1][0] : inside[1][-1] + 1]
        part = _unknown_lowest(part)
        for axis in range(2):
            columns, first = np.unique(cells[axis][inside[axis]], return_index=True)
            part = np.maximum.reduceat(part, first, axis=axis)
            inside[axis] = columns
        top = np.full(shape, -np.inf, np.float32)
        top[np.ix_(inside[1], inside[0])] = part.T
        top = _with_unseen(top, resolution)
        return HighGround(top, _highest_within(_BORDER, top, resolution))


def _unknown_lowest(height: np.ndarray) -> np.ndarray:
    """Heights with -inf for NaN, so that the highest of several is the highest known one."""
    return np.where(np.isnan(height), np.float32(-np.inf), height)


def _highest_within(distance: float, height: np.ndarray, resolution: float) -> np.ndarray:
    """The highest cell of a raster within ``distance`` along both axes [m] of each."""
    side = 2 * int(np.ceil(distance / resolution)) + 1
    return cv2.dilate(height, np.ones((side, side), np.uint8), borderValue=-np.inf)


def _with_unseen(height: np.ndarray, resolution: float) -> np.ndarray:
    """A raster of heights in which cells of which nothing is known (-inf) are as high as the highest within _UNSEEN."""
    return np.where(np.isneginf(height), _highest_within(_UNSEEN, height, resolution), height)


@njit(cache=True, nogil=True)
def _height_at(height, origin, resolution, x, y):
    """The value of a raster at x, y, its nearest one beyond its border."""
    ix, iy = int(np.rint((x - origin[0]) / resolution)), int(np.rint((y - origin[1]) / resolution))
    return height[min(max(iy, 0), height.shape[0] - 1), min(max(ix, 0), height.shape[1] - 1)]


@njit(cache=True, nogil=True)
def leave_out_without_room(top, around, height, origin, resolution, poses, ground, points, fore, hind, belly, out):
    """Sets ``out`` (n,) to inf where something stands in the torso's way.

    The belly is inclined as the line through the ground under the hind and the fore feet, and that far above it.

    Args:
        top, around: of a HighGround; height, origin, resolution: of its SupportMap.
        poses: x, y, yaw of the base in W, (n, 3).
        ground: height of the ground under the base [m], (n,).
        points, fore, hind: of a Torso.
        belly: its height, less what is to stay free below it [m].
    """
    for n in range(len(poses)):
        x0, y0, c, s = poses[n, 0], poses[n, 1], np.cos(poses[n, 2]), np.sin(poses[n, 2])
        if out[n] == np.inf or _height_at(around, origin, resolution, x0, y0) < ground[n] + _WORTH_A_LOOK * belly:
            continue
        before = _height_at(height, origin, resolution, x0 + c * fore, y0 + s * fore)
        behind = _height_at(height, origin, resolution, x0 + c * hind, y0 + s * hind)
        slope, too_high = (before - behind) / (fore - hind), 0
        for k in range(len(points)):
            x, y = x0 + c * points[k, 0] - s * points[k, 1], y0 + s * points[k, 0] + c * points[k, 1]
            level = behind + slope * (points[k, 0] - hind)
            too_high += _height_at(top, origin, resolution, x, y) > level + belly
            if too_high >= _LEAST_POINTS:
                out[n] = np.inf
                break


class TorsoRoom:
    """Whether a pose of the base has room for the torso over one piece of ground."""

    def __init__(self, robot, heights: GroundHeights, *, clearance: float):
        """
        Args:
            robot: RobotModel.
            heights: of all surfaces; what it does not know is no lower than what is around it, see ``_with_unseen``.
            clearance: what comes so near to the torso from below or from its sides is in its way [m].
        """
        low, high = body_corners(robot)
        self._heights, self._low, self._high = heights, low - clearance, high + clearance
        self._least = -self._low[2]
        known = _unknown_lowest(heights.height)
        self._highest = _with_unseen(known, heights.cell) if known.size else known

    def __call__(self, p_WB: np.ndarray, rpy_WB: np.ndarray) -> bool:
        """Whether nothing is in the way there; position in W [m], (3,), and roll, pitch, yaw [rad], (3,)."""
        corner, cell = self._heights.corner, self._heights.cell
        return _has_room(self._highest, corner, cell, p_WB, rotation_from_rpy(rpy_WB), self._low, self._high, self._least)


@njit(cache=True)
def _has_room(height, corner, cell, p_WB, R_WB, low, high, least):
    """Whether fewer than _LEAST_POINTS cells under a box from ``low`` to ``high`` (3,) are less than ``least`` below B."""
    too_high = 0
    for i in range(int((high[0] - low[0]) / cell) + 1):
        for j in range(int((high[1] - low[1]) / cell) + 1):
            x, y = low[0] + cell * i, low[1] + cell * j
            row = int(np.floor((p_WB[0] + R_WB[0, 0] * x + R_WB[0, 1] * y - corner[0]) / cell))
            column = int(np.floor((p_WB[1] + R_WB[1, 0] * x + R_WB[1, 1] * y - corner[1]) / cell))
            if 0 <= row < height.shape[0] and 0 <= column < height.shape[1]:
                too_high += height[row, column] > p_WB[2] + R_WB[2, 0] * x + R_WB[2, 1] * y - least
                if too_high >= _LEAST_POINTS:
                    return False
    return True
