"""Stones in a pit: on a regular grid, on a random part of one, and irregularly posed with spheres on some."""

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import PLATFORM_THICKNESS, pit_floor, platform
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Sphere, Terrain, pose
from quadpips_drake.values.steppability import Steppability


@takes_difficulty("gap", "gap between stones", "m", low=0.0, high=0.5)
def stepping_stones(
    *,
    seed: int = 0,
    pit_length: float = 1.5,
    pit_depth: float = 1.0,
    stone_size: float = 0.30,
    gap: float = 0.10,
    columns: int = 8,
    rise: float = 0.0,
) -> Terrain:
    """Two platforms with a pit between them, crossed on a grid of square stones.

    The pit reaches from x = 0 to ``pit_length``. As many rows of stones stand in it as fit with ``gap`` between them and at
    least as much to the platforms; what is left is split between the two platform edges (by default 3 rows, 0.20 m to
    either platform; a pit of 1.7 m has 4 rows and 0.10 m everywhere). Stones are columns that stand on the pit floor;
    neighbouring stones differ by ``rise`` in height like on a chess board. Lengths in m.
    """
    if stone_size <= 0 or gap < 0 or columns < 1 or pit_length < stone_size + 2 * gap:
        raise UserInputError(
            "stepping_stones: stone_size > 0, gap >= 0, columns >= 1 and pit_length >= stone_size + 2 gap are needed"
        )
    rows = int((pit_length - gap + 1e-9) // (stone_size + gap))
    pitch = stone_size + gap
    x_first = 0.5 * pit_length - 0.5 * pitch * (rows - 1)
    width = max(columns * pitch + 1.0, 3.0)
    elements = [
        platform("start_platform", -3.0, 0.0, width),
        platform("goal_platform", pit_length, pit_length + 3.0, width),
        pit_floor(-3.0, pit_length + 3.0, width, -pit_depth),
    ]
    for row in range(rows):
        for column in range(columns):
            top = rise * ((row + column) % 2)
            height = pit_depth + top
            center = (x_first + pitch * row, pitch * (column - 0.5 * (columns - 1)), top - 0.5 * height)
            elements.append(Box(name=f"stone_{row}_{column}", size=(stone_size, stone_size, height), X_WE=pose(center)))
    return Terrain("stepping_stones", (-1, 0, 0), (pit_length + 1.0, 0), DEFAULT_FRICTION, tuple(elements))


@takes_difficulty("probability", "density of the stones", "1", low=0.1, high=1.0, larger_is_harder=False)
def sparse_stones(
    *, seed: int = 0, probability: float = 0.4, stone_size: float = 0.15, rows: int = 20, columns: int = 20
) -> Terrain:
    """A pit with stones on a random part of the places of a grid.

    Each place holds a stone with ``probability``, drawn by ``seed``; the grid itself has no gaps. Lengths in m.
    """
    rng = np.random.default_rng(seed)
    half, width = 0.5 * stone_size * columns, stone_size * rows + 1.0
    elements = [
        platform("start_platform", -half - 3.0, -half, width),
        platform("goal_platform", half, half + 3.0, width),
        pit_floor(-half - 3.0, half + 3.0, width, -1.0),
    ]
    for row in range(rows):
        for column in range(columns):
            if rng.random() < probability:
                x, y = stone_size * (column + 0.5) - half, stone_size * (row + 0.5 - 0.5 * rows)
                size = (stone_size, stone_size, PLATFORM_THICKNESS)
                center = (x, y, -0.5 * PLATFORM_THICKNESS)
                elements.append(Box(name=f"stone_{row}_{column}", size=size, X_WE=pose(center)))
    return Terrain("sparse_stones", (-half - 1.0, 0, 0), (half + 1.0, 0), DEFAULT_FRICTION, tuple(elements))


_PITCH, _COLUMNS = 0.28, 8
"""Distance of the centres of irregular stones, and how many there are side by side; the way leads between the middle two."""
_SIZES, _SHIFT = (0.19, 0.23), 0.02
"""Of irregular stones, and how far chance moves them in x, y and z [m]."""
_TURN, _TILT = 0.4, 0.08
"""Largest yaw, and largest roll and pitch of irregular stones [rad]."""
_SPHERE, _RAISED = 0.43, 0.5
"""Radius of a sphere, of the size of its stone; and how far its centre lies above that, of its radius."""


@takes_difficulty("spheres", "share of the outer stones with a sphere", "1", low=0.0, high=0.8)
def irregular_stones(*, seed: int = 0, spheres: float = 0.15, rows: int = 4) -> Terrain:
    """A pit that is crossed on irregularly posed stones, some of which carry a sphere.

    Stones of 0.19 to 0.23 m on a grid of 0.28 m, moved by up to 2 cm, turned by up to 0.4 rad and tilted by up to 0.08 rad.
    In every other row one of the two stones beside the straight way carries a sphere, and each of the others with the
    probability ``spheres``: all drawn by ``seed``. A sphere, sunk into its stone by a quarter of its diameter, leaves no
    room for a foot beside it.
    """
    if rows < 1:
        raise UserInputError("irregular_stones: at least one row is needed")
    rng = np.random.default_rng(seed)
    length, width = _PITCH * rows, _PITCH * _COLUMNS + 1.0
    elements = [
        platform("start_platform", -3.0, 0.0, width),
        platform("goal_platform", length, length + 3.0, width),
        pit_floor(-3.0, length + 3.0, width, -1.0),
    ]
    spheres_on_them = []
    for row in range(rows):
        middle = rng.integers(2) + _COLUMNS // 2 - 1
        for column in range(_COLUMNS):
            size = rng.uniform(*_SIZES)
            x, y, z = np.array([row + 0.5, column + 0.5 - 0.5 * _COLUMNS, 0.0]) * _PITCH + rng.uniform(-_SHIFT, _SHIFT, 3)
            X_WT = pose((x, y, z), (*rng.uniform(-_TILT, _TILT, 2), rng.uniform(-_TURN, _TURN)))
            X_TE = pose((0.0, 0.0, -0.5 * PLATFORM_THICKNESS))
            name, chosen = f"{row}_{column}", rng.random() < spheres
            elements.append(Box(name=f"stone_{name}", size=(size, size, PLATFORM_THICKNESS), X_WE=X_WT @ X_TE))
            beside = abs(column + 0.5 - 0.5 * _COLUMNS) < 1.0
            if row % 2 == 0 and (column == middle if beside else chosen):
                radius = _SPHERE * size
                center = X_WT @ pose((0.0, 0.0, _RAISED * radius))
                sphere = Sphere(name=f"sphere_{name}", radius=radius, X_WE=center, label=Steppability.NON_PASSABLE)
                spheres_on_them.append(sphere)
    return Terrain("irregular_stones", (-0.9, 0, 0), (length + 0.8, 0), DEFAULT_FRICTION, (*elements, *spheres_on_them))
