"""The worlds of the study of growth: fields of boxes, and planar regions, of any number."""

import numpy as np

from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose
from quadpips_drake.values.regions import PlanarRegion, RegionSet

_PITCH = 0.30
"""Of the boxes [m]; eight of them carry the robot."""
_STONE, _GAP = 0.30, 0.10
"""[m]"""
_LANE = np.array([[-0.8, 3.2], [-0.8, 0.8]])
"""Lowest and highest x, and y, of the lane [m]."""
_INSET = 0.04
"""From the border of a region to its inset [m], or a quarter of its width where that is less."""


def field_of_boxes(count: int) -> Terrain:
    """Columns side by side whose tops differ by up to 1 cm; the robot stands in the middle, which is its goal, too.

    Of all places on a grid those nearest to the middle are taken (an ellipse along x), so that what is near the robot is the
    same in large fields and in small ones.
    """
    half = int(np.ceil(np.sqrt(count))) + 2
    places = _PITCH * (np.stack(np.meshgrid(np.arange(-half, half), np.arange(-half, half)), axis=-1).reshape(-1, 2) + 0.5)
    places = places[np.argsort(np.hypot(places[:, 0], 2.0 * places[:, 1]), kind="stable")[:count]]
    tops = np.random.default_rng(0).uniform(-0.005, 0.005, count)
    boxes = [
        Box(name=f"box_{k}", size=(_PITCH, _PITCH, 0.2 + top), X_WE=pose((x, y, 0.5 * (top - 0.2))))
        for k, ((x, y), top) in enumerate(zip(places, tops, strict=True))
    ]
    return Terrain("field", (0.0, 0.0, 0.0), (0.0, 0.0), DEFAULT_FRICTION, tuple(boxes))


def square_of_stones(count: int) -> tuple[RegionSet, np.ndarray]:
    """``count`` regions, level and at one height: what the robot stands on, and stones ahead of it in a square; the goal.

    The goal is on the last stones, at most 3 m ahead.
    """
    rows = max(round(np.sqrt(count - 1)), 1)
    columns = int(np.ceil((count - 1) / rows))
    pitch = _STONE + _GAP
    x, y = 0.7 + _GAP + 0.5 * _STONE + pitch * np.arange(rows), pitch * (np.arange(columns) - 0.5 * (columns - 1))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    regions = [_rectangle(0, (-0.05, 0.0), (1.5, 1.8))]
    regions += [_rectangle(k + 1, place, (_STONE, _STONE)) for k, place in enumerate(places[: count - 1])]
    return RegionSet(0.0, tuple(regions)), np.array([min(x[-1], 3.0), 0.0])


def paved_lane(count: int) -> tuple[RegionSet, np.ndarray]:
    """A lane of 4 m by 1.6 m that is cut into about ``count`` squares; the goal, 2.4 m ahead."""
    length, width = _LANE[:, 1] - _LANE[:, 0]
    rows = max(round(np.sqrt(count * width / length)), 1)
    columns = round(count / rows)
    size = (length / columns, width / rows)
    places = [_LANE[:, 0] + np.array(size) * (i + 0.5, j + 0.5) for i in range(columns) for j in range(rows)]
    return RegionSet(0.0, tuple(_rectangle(k, place, size) for k, place in enumerate(places))), np.array([2.4, 0.0])


def _rectangle(region_id: int, center, size) -> PlanarRegion:
    X_WR = np.eye(4)
    X_WR[:2, 3] = center
    corners = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size
    return PlanarRegion(region_id, X_WR, corners, corners - np.sign(corners) * np.minimum(_INSET, 0.25 * np.asarray(size)))
