"""Uneven fields of columns and boxes, drawn by the seed."""

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import PLATFORM_THICKNESS, ground, platform
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose


@takes_difficulty("height", "height of the bumps", "m", low=0.0, high=0.2)
def bumps(*, seed: int = 0, height: float = 0.03, size: float = 0.25, length: float = 3.5, width: float = 3.0) -> Terrain:
    """Square columns whose tops differ by up to 3 cm up or down, between two platforms.

    Each column is ``size`` wide and ends anywhere within ``height`` of z = 0, drawn by ``seed``; the field is ``length`` by
    ``width``. Lengths in m.
    """
    if height < 0 or size <= 0 or min(length, width) < size:
        raise UserInputError("bumps: height >= 0, size > 0, and length and width of at least one column are needed")
    rng = np.random.default_rng(seed)
    rows, columns, depth = int(length / size), int(width / size), height + PLATFORM_THICKNESS
    elements = [
        platform("start_platform", -3.0, 0.0, width + 1.0),
        platform("goal_platform", rows * size, rows * size + 3.0, width + 1.0),
    ]
    for row in range(rows):
        for column in range(columns):
            top = rng.uniform(-height, height)
            center = (size * (row + 0.5), size * (column + 0.5 - 0.5 * columns), 0.5 * (top - depth))
            elements.append(Box(name=f"column_{row}_{column}", size=(size, size, depth + top), X_WE=pose(center)))
    return Terrain("bumps", (-0.6, 0, 0), (round(rows * size + 0.7, 2), 0), DEFAULT_FRICTION, tuple(elements))


_COUNT, _PITCH = 10, 0.3
"""Boxes along either side of the original worlds' fields, and the distance of their centres [m]."""
_FIELD_START, _FIELD_GOAL = (-2.5, 1.4, 0.0), (3.5, 1.4)
_RIDGE = (0.0, 0.05, 0.10, 0.15, 0.20, 0.25, 0.20, 0.15, 0.10, 0.05)
"""Of the boxes' centres along x, before chance [m]."""


@takes_difficulty("unevenness", "unevenness of the boxes", "m", low=0.0, high=0.2)
def pegboard(*, seed: int = 0, unevenness: float = 0.075) -> Terrain:
    """A field of boxes up to 0.3 m high, of uneven height, over a ridge.

    10 x 10 level boxes, 0.3 x 0.3 x 0.1 m, side by side on the ground; their tops rise from 0.05 to 0.30 m and fall again,
    each up to ``unevenness`` [m] higher, drawn by ``seed``.
    """
    rng = np.random.default_rng(seed)
    elements = [ground(14.0)]
    for row in range(_COUNT):
        for column in range(_COUNT):
            center = (_PITCH * column, _PITCH * row, _RIDGE[column] + unevenness * rng.random())
            elements.append(Box(name=f"box_{row}_{column}", size=(_PITCH, _PITCH, 0.1), X_WE=pose(center)))
    return Terrain("pegboard", _FIELD_START, _FIELD_GOAL, DEFAULT_FRICTION, tuple(elements))


@takes_difficulty("tilt", "largest tilt of a box", "rad", low=0.0, high=0.6)
def rubble(*, seed: int = 0, tilt: float = 0.25) -> Terrain:
    """A heap of tilted boxes that overlap.

    10 x 10 boxes of 0.30 to 0.45 m, 0.1 m thick and half sunk in the ground, 0.3 m apart; roll and pitch up to ``tilt``
    [rad] either way, yaw up to 0.25 rad, moved by up to 3 cm: all drawn by ``seed``.
    """
    rng = np.random.default_rng(seed)
    elements = [ground(14.0)]
    for row in range(_COUNT):
        for column in range(_COUNT):
            length, width = _PITCH * (1.0 + 0.5 * rng.random(2))
            x, y = _PITCH * np.array([column, row]) + 0.03 * (2.0 * rng.random(2) - 1.0)
            rpy = np.array([tilt, tilt, 0.25]) * (2.0 * rng.random(3) - 1.0)
            elements.append(Box(name=f"box_{row}_{column}", size=(length, width, 0.1), X_WE=pose((x, y, 0.0), rpy)))
    return Terrain("rubble", _FIELD_START, _FIELD_GOAL, DEFAULT_FRICTION, tuple(elements))
