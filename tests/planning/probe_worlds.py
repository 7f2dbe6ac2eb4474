"""Small worlds for the probe of the searches: boxes by hand, named with one number."""

import numpy as np

from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.terrain import Box, Terrain, pose


def _slab(x, y, size_x, size_y, top=0.0, rpy=(0.0, 0.0, 0.0), thickness=0.1):
    return Box(size=(size_x, size_y, thickness), X_WE=pose((x, y, top - 0.5 * thickness), rpy))


def _ends(length, *between, width=3.0, goal_y=0.0):
    """Two platforms, ``length`` [m] apart, and what lies between them; the pit begins at x = 0."""
    slabs = (_slab(-1.5, 0, 3.0, width), _slab(length + 1.5, goal_y, 3.0, width), *between)
    return Terrain("probe", (-0.8, 0, 0), (length + 1.0, goal_y), 1.0, slabs)


def beam(width, length=2.5):
    return _ends(length, _slab(0.5 * length, 0, length, width))


def trench(width):
    return _ends(width)


def trenches(width):
    """Three in a row with half a metre between them."""
    return _ends(3 * width + 1.0, *(_slab(width + 0.25 + k * (width + 0.5), 0, 0.5, 3.0) for k in range(2)))


def parallel_beams(apart, length=2.5, width=0.2):
    return _ends(length, *(_slab(0.5 * length, side * 0.5 * apart, length, width) for side in (-1, 1)))


def ramp(degrees, length=2.5):
    a = np.radians(degrees)
    run, climb, t = length * np.cos(a), length * np.sin(a), 0.05
    top = _slab(run + 1.5, 0, 3.0, 3.0, climb)
    ramp_slab = Box(
        size=(length, 3.0, 0.1), X_WE=pose((0.5 * run + t * np.sin(a), 0, 0.5 * climb - t * np.cos(a)), (0, -a, 0))
    )
    return Terrain("probe", (-0.8, 0, 0), (run + 1.0, 0), 1.0, (_slab(-1.5, 0, 3.0, 3.0), ramp_slab, top))


def pegs(gap, peg=0.12, length=2.0):
    pitch = peg + gap
    n, m = int((length - gap) / pitch), 13
    spots = [((i + 0.5) * pitch + 0.5 * gap, (j - m // 2) * pitch) for i in range(n) for j in range(m)]
    return _ends(n * pitch + gap, *(_slab(x, y, peg, peg) for x, y in spots))


def winding(aside, width=0.5):
    """A beam with two bends of 90 degrees; the goal is ``aside`` [m] to the left."""
    w = 0.5 * width
    return _ends(
        3.0,
        _slab(0.5 * (1.5 + w), 0, 1.5 + w, width),
        _slab(1.5, 0.5 * aside, width, aside),
        _slab(0.5 * (1.5 - w + 3.0), aside, 1.5 + w, width),
        goal_y=aside,
        width=1.6,
    )


def detour(aside, width=0.5):
    """A beam that goes ``aside`` [m] and comes back: the goal is straight ahead behind a pit."""
    w = 0.5 * width
    return _ends(
        4.0,
        _slab(0.5 * (1.0 + w), 0, 1.0 + w, width),
        _slab(1.0, 0.5 * aside, width, aside + width),
        _slab(2.0, aside, 2.0 + width, width),
        _slab(3.0, 0.5 * aside, width, aside + width),
        _slab(0.5 * (3.0 - w + 4.0), 0, 1.0 + w, width),
        width=1.6,
    )


def obstructed(height, width=0.5, length=3.0):
    """A beam with three barriers across it, ``height`` [m] high and 5 cm thick; no foot is meant to stand on them."""
    bars = [Box(size=(0.05, width, height), X_WE=pose((0.75 + 0.75 * k, 0, 0.5 * height)), label=2) for k in range(3)]
    return _ends(length, _slab(0.5 * length, 0, length, width), *bars)


def sparse(seed):
    return load_terrain("sparse_stones", seed=int(seed))


def rubble(seed, size=0.25, length=2.5):
    """Boxes tilted and raised at random, side by side."""
    rng = np.random.default_rng(int(seed))
    n, m = int(length / size), 10
    boxes = [
        _slab(
            (i + 0.5) * size, (j + 0.5 - m / 2) * size, size, size, rng.uniform(-0.06, 0.06), (*rng.uniform(-0.2, 0.2, 2), 0)
        )
        for i in range(n)
        for j in range(m)
    ]
    return _ends(n * size, *boxes)


def flat(degrees, distance=1.0):
    """Level ground; the goal lies in the direction ``degrees`` from straight ahead."""
    a = np.radians(degrees)
    goal = (distance * np.cos(a), distance * np.sin(a))
    return Terrain("probe", (0, 0, 0), goal, 1.0, (_slab(0, 0, 12.0, 12.0),))


def stepping(gap):
    from quadpips_drake.terrain.library import stepping_stones

    return stepping_stones(gap=gap)


def stairs(rise):
    return __import__("quadpips_drake.terrain.library", fromlist=["stairs"]).stairs(rise=rise)


def island(gap):
    """The goal's platform is out of reach."""
    return _ends(gap)


WORLDS = {
    "beam": beam, "trench": trench, "trenches": trenches, "parallel_beams": parallel_beams, "ramp": ramp, "pegs": pegs,
    "winding": winding, "detour": detour, "obstructed": obstructed, "sparse": sparse, "rubble": rubble, "flat": flat,
    "stepping": stepping, "stairs": stairs, "island": island,
}  # fmt: skip
