"""The terrains that come with the package, each made by a function with keyword parameters.

Dimensions of `ramp_10`, `stairs` and `sparse_stones` are those of the QuadPiPS worlds (2026, section VIII; for ANYmal C the
starts lie closer to the obstacle, and `sparse_stones` is centred on y = 0). Robots walk in +x.
"""

import math
from pathlib import Path

import numpy as np

from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.framework.registry import Registry
from quadpips_drake.terrain.stone_setup import read_stone_setup
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose
from quadpips_drake.terrain.terrain_file import read_terrain_file
from quadpips_drake.values.steppability import Steppability

PLATFORM_THICKNESS = 0.1


def flat(*, seed: int = 0, size: float = 16.0, distance: float = 3.0) -> Terrain:
    """Level ground. It is a square of ``size`` [m]; the goal lies ``distance`` [m] ahead of the start."""
    return Terrain("flat", (0, 0, 0), (distance, 0), DEFAULT_FRICTION, (_ground(size),))


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
        _platform("start_platform", -3.0, 0.0, width),
        _platform("goal_platform", pit_length, pit_length + 3.0, width),
        _pit_floor(-3.0, pit_length + 3.0, width, -pit_depth),
    ]
    for row in range(rows):
        for column in range(columns):
            top = rise * ((row + column) % 2)
            height = pit_depth + top
            center = (x_first + pitch * row, pitch * (column - 0.5 * (columns - 1)), top - 0.5 * height)
            elements.append(Box(name=f"stone_{row}_{column}", size=(stone_size, stone_size, height), X_WE=pose(center)))
    return Terrain("stepping_stones", (-1, 0, 0), (pit_length + 1.0, 0), DEFAULT_FRICTION, tuple(elements))


def sparse_stones(
    *, seed: int = 0, probability: float = 0.4, stone_size: float = 0.15, rows: int = 20, columns: int = 20
) -> Terrain:
    """A pit with stones on a random part of the places of a grid.

    Each place holds a stone with ``probability``, drawn by ``seed``; the grid itself has no gaps. Lengths in m.
    """
    rng = np.random.default_rng(seed)
    half, width = 0.5 * stone_size * columns, stone_size * rows + 1.0
    elements = [
        _platform("start_platform", -half - 3.0, -half, width),
        _platform("goal_platform", half, half + 3.0, width),
        _pit_floor(-half - 3.0, half + 3.0, width, -1.0),
    ]
    for row in range(rows):
        for column in range(columns):
            if rng.random() < probability:
                x, y = stone_size * (column + 0.5) - half, stone_size * (row + 0.5 - 0.5 * rows)
                size = (stone_size, stone_size, PLATFORM_THICKNESS)
                center = (x, y, -0.5 * PLATFORM_THICKNESS)
                elements.append(Box(name=f"stone_{row}_{column}", size=size, X_WE=pose(center)))
    return Terrain("sparse_stones", (-half - 1.0, 0, 0), (half + 1.0, 0), DEFAULT_FRICTION, tuple(elements))


def ramp_10(*, seed: int = 0, angle: float = 0.175, length: float = 3.0, width: float = 3.0) -> Terrain:
    """A ramp of 10 degrees up to a platform.

    ``angle`` of the ramp in rad, ``length`` and ``width`` in m. As in the original world the mid-plane of the 0.1 m thick
    ramp starts on the ground, so that its top begins with a lip of 0.049 m.
    """
    if not 0 < angle < 1.2:
        raise UserInputError("ramp_10: angle must be between 0 and 1.2 rad")
    run, climb = length * math.cos(angle), length * math.sin(angle)
    size = (length, width, PLATFORM_THICKNESS)
    platform = (3.0, width, PLATFORM_THICKNESS)
    elements = (
        _ground(14.0),
        Box(name="ramp", size=size, X_WE=pose((0, 0, 0.5 * climb), (0, -angle, 0))),
        Box(name="platform", size=platform, X_WE=pose((0.5 * run + 1.5, 0, climb))),
    )
    return Terrain("ramp_10", (round(-0.5 * run - 0.8, 1), 0, 0), (round(0.5 * run + 1.1, 1), 0), DEFAULT_FRICTION, elements)


def stairs(*, seed: int = 0, rise: float = 0.05, run: float = 0.20, steps: int = 10, width: float = 3.0) -> Terrain:
    """Stairs up to a platform.

    There are ``steps`` treads, each ``rise`` higher and ``run`` further than the last. Lengths in m.
    """
    if rise <= 0 or run <= 0 or steps < 1:
        raise UserInputError("stairs: rise > 0, run > 0 and steps >= 1 are needed")
    elements = [_ground(14.0)]
    for i in range(steps):
        center = (run * i, 0, rise * (i + 0.5))
        elements.append(Box(name=f"tread_{i}", size=(run, width, rise), X_WE=pose(center)))
    # The platform's centre lies `rise / 2` above the last tread's, as in the original world (top 0.525 m at rise 0.05 m).
    end = run * (steps - 0.5)
    elements.append(Box(name="platform", size=(3.0, width, rise), X_WE=pose((end + 1.5, 0, rise * steps))))
    return Terrain("stairs", (-0.5 * run - 1.1, 0, 0), (end + 1.0, 0), DEFAULT_FRICTION, tuple(elements))


def slope(*, seed: int = 0, angle: float = 0.2618, length: float = 3.0, width: float = 6.0) -> Terrain:
    """A slope of 15 degrees up to a platform, and another one down behind it.

    ``angle`` in rad, ``length`` of either slope and ``width`` in m. Slopes and platform join without a lip.
    """
    if not 0 < angle < 1.2:
        raise UserInputError("slope: angle must be between 0 and 1.2 rad")
    run, climb = length * math.cos(angle), length * math.sin(angle)
    top = 2.0
    tilted = 0.5 * PLATFORM_THICKNESS * np.array([math.sin(angle), math.cos(angle)])  # from mid-plane to top
    up = (0.5 * run + tilted[0], 0, 0.5 * climb - tilted[1])
    down = (1.5 * run + top - tilted[0], 0, up[2])
    elements = (
        _ground(20.0),
        Box(name="up", size=(length, width, PLATFORM_THICKNESS), X_WE=pose(up, (0, -angle, 0))),
        Box(
            name="platform",
            size=(top, width, PLATFORM_THICKNESS),
            X_WE=pose((run + 0.5 * top, 0, climb - 0.5 * PLATFORM_THICKNESS)),
        ),
        Box(name="down", size=(length, width, PLATFORM_THICKNESS), X_WE=pose(down, (0, angle, 0))),
    )
    return Terrain("slope", (-0.7, 0, 0), (round(run + 0.5 * top, 2), 0), DEFAULT_FRICTION, elements)


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
        _platform("start_platform", -3.0, 0.0, width + 1.0),
        _platform("goal_platform", rows * size, rows * size + 3.0, width + 1.0),
    ]
    for row in range(rows):
        for column in range(columns):
            top = rng.uniform(-height, height)
            center = (size * (row + 0.5), size * (column + 0.5 - 0.5 * columns), 0.5 * (top - depth))
            elements.append(Box(name=f"column_{row}_{column}", size=(size, size, depth + top), X_WE=pose(center)))
    return Terrain("bumps", (-0.6, 0, 0), (round(rows * size + 0.7, 2), 0), DEFAULT_FRICTION, tuple(elements))


terrains = Registry("terrain", "quadpips_drake.terrains")
"""``factory(seed=...)`` returns a Terrain; its docstring's first line is what lists say."""

for _generator in (bumps, flat, ramp_10, slope, sparse_stones, stairs, stepping_stones):
    terrains.add(_generator.__name__, _generator)


def terrain_names() -> list[str]:
    """Names that ``load_terrain`` knows, sorted."""
    return terrains.names()


def load_terrain(name_or_path: str, seed: int = 0, start=None, goal=None) -> Terrain:
    """Returns a terrain of the library by name, or reads one from a file (.yaml, .yml, or the authors' .json).

    ``seed`` decides what is random in a library terrain. ``start`` (x, y, yaw) and ``goal`` (x, y), when given, replace
    those of the terrain; a .json file has none of its own. Raises UserInputError with one line for whatever is wrong.
    """
    text = str(name_or_path)
    suffix = Path(text).suffix.lower()
    if text in terrains:
        return _with_ends(terrains.get(text).factory(seed=seed), start, goal)
    if suffix in (".yaml", ".yml"):
        return read_terrain_file(text, start, goal)
    if suffix == ".json":
        return read_stone_setup(text, start, goal)
    if suffix or "/" in text:
        raise UserInputError(f"terrain file '{text}': the name must end in .yaml, .yml or .json")
    raise unknown_name("terrain", text, terrain_names())


def _with_ends(terrain: Terrain, start, goal) -> Terrain:
    if start is None and goal is None:
        return terrain
    start = terrain.start if start is None else start
    goal = terrain.goal if goal is None else goal
    return Terrain(terrain.name, start, goal, terrain.friction, terrain.elements)


def _ground(size: float) -> Box:
    return Box(name="ground", size=(size, size, 0.2), X_WE=pose((0, 0, -0.1)))


def _platform(name: str, x_from: float, x_to: float, width: float) -> Box:
    """A slab with its top at z = 0."""
    size = (x_to - x_from, width, PLATFORM_THICKNESS)
    return Box(name=name, size=size, X_WE=pose((0.5 * (x_from + x_to), 0, -0.5 * PLATFORM_THICKNESS)))


def _pit_floor(x_from: float, x_to: float, width: float, top: float) -> Box:
    """The bottom of a pit, wider than the rest so that a camera does not look past it into the void."""
    size = (x_to - x_from, width + 4.0, PLATFORM_THICKNESS)
    center = (0.5 * (x_from + x_to), 0, top - 0.5 * PLATFORM_THICKNESS)
    return Box(name="pit_floor", size=size, X_WE=pose(center), label=Steppability.NON_PASSABLE)
