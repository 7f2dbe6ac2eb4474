"""The nine primitive shapes of the steppability data and their label policies (QuadPiPS section V-B).

Shapes, size ranges and policies are those of QuadPiPS section V-B.1-2 and of its forerunner (seed 003, Table 1). A shape is
a list of patches: triangles in the scene frame W that share one label, so that faces of one body can differ.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.values.steppability import Steppability

SIDES = 20
"""Corners of what is round."""
SIZE_RANGES = {
    "cuboid": {"length": (0.20, 1.00), "width": (0.10, 0.50), "height": (0.05, 0.25)},
    "ramp": {"length": (0.20, 1.00), "width": (0.10, 0.50), "height": (0.05, 0.25)},
    "cylinder": {"radius_x": (0.10, 0.50), "radius_y": (0.10, 0.50), "height": (0.05, 0.25)},
    "sphere": {"radius": (0.025, 0.05)},
    "semisphere": {"radius": (0.025, 0.05)},
    "pipe": {"length": (0.10, 0.50), "radius": (0.025, 0.05)},
    "pole": {"length": (0.10, 0.50), "radius": (0.025, 0.05)},
    "tube": {"length": (0.50, 1.00), "radius": (0.025, 0.05)},
    "floor": {},
}
"""Least and largest value of each parameter [m]; a floor is 4 m x 4 m."""
FLOOR_SIZE = 4.0
"""Edge length of a floor [m]."""


@configuration
class LabelPolicy:
    """Which label a face gets."""

    swing_height_max: float = ranged(0.15, 0.001, 1.0)
    """What a swinging foot clears, h_swing_max [m]."""

    def obstacle(self, height: float) -> Steppability:
        """Returns PASSABLE or NON_PASSABLE for a vertical face or a round body that rises ``height`` [m]."""
        return Steppability.PASSABLE if height <= self.swing_height_max else Steppability.NON_PASSABLE


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles with one label."""

    triangles: np.ndarray
    """Corners in W [m], (n, 3, 3)."""
    label: Steppability

    def moved(self, X_WP: np.ndarray) -> "Patch":
        """Returns the patch with its points taken as given in the frame P, whose pose in W is ``X_WP`` (4, 4)."""
        return Patch(self.triangles @ X_WP[:3, :3].T + X_WP[:3, 3], self.label)


def cuboid(size, policy: LabelPolicy, drops=None) -> list[Patch]:
    """A box of ``size`` (length, width, height) [m] that stands on z = 0; its top is steppable.

    ``drops``: height discontinuity at the sides +x, +y, -x, -y [m]; by default the height of the box, all around.
    """
    length, width, height = size
    corners = 0.5 * np.array([[length, -width], [length, width], [-length, width], [-length, -width]])
    drops = [height] * 4 if drops is None else drops
    top, bottom, sides = _extrude(corners, height)
    patches = [Patch(top, Steppability.STEPPABLE), Patch(bottom, policy.obstacle(max(drops)))]
    return patches + [Patch(side, policy.obstacle(drop)) for side, drop in zip(sides, drops, strict=True)]


def ramp(size, policy: LabelPolicy) -> list[Patch]:
    """A wedge of ``size`` (length, width, height) [m] that stands on z = 0 and rises along x; its slope is steppable."""
    length, width, height = size
    x, y = 0.5 * length, 0.5 * width
    a, b, c, d = (-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)
    e, f = (x, -y, height), (x, y, height)
    faces = _triangles([(a, b, e), (d, f, c), (b, c, f), (b, f, e), (a, d, c), (a, c, b)])
    return [Patch(_triangles([(a, e, f), (a, f, d)]), Steppability.STEPPABLE), Patch(faces, policy.obstacle(height))]


def cylinder(radius_x: float, radius_y: float, height: float, policy: LabelPolicy, drop=None) -> list[Patch]:
    """An upright elliptic cylinder on z = 0 [m]; its top is steppable. ``drop``: discontinuity around it, or its height."""
    top, bottom, sides = _extrude(_circle() * [radius_x, radius_y], height)
    label = policy.obstacle(height if drop is None else drop)
    return [Patch(top, Steppability.STEPPABLE), Patch(np.concatenate([bottom, *sides]), label)]


def sphere(radius: float, policy: LabelPolicy, support: float = 0.0) -> list[Patch]:
    """A ball on z = 0 [m]. ``support``: height of what it lies on above the ground [m]."""
    triangles = _dome(radius, -0.5 * math.pi) + np.array([0, 0, radius])
    return [Patch(triangles, policy.obstacle(support + 2 * radius))]


def semisphere(radius: float, policy: LabelPolicy, support: float = 0.0) -> list[Patch]:
    """Half a ball, flat side down on z = 0 [m]. ``support``: height of what it lies on above the ground [m]."""
    return [Patch(_dome(radius, 0.0), policy.obstacle(support + radius))]


def pole(length: float, radius: float, policy: LabelPolicy, support: float = 0.0) -> list[Patch]:
    """An upright solid bar on z = 0 [m]. ``support``: height of what it stands on above the ground [m]."""
    top, bottom, sides = _extrude(radius * _circle(), length)
    return [Patch(np.concatenate([top, bottom, *sides]), policy.obstacle(support + length))]


def pipe(length: float, radius: float, policy: LabelPolicy, support: float = 0.0) -> list[Patch]:
    """A hollow bar along x whose lowest line is on z = 0 [m]; ``support``: height of that line above the ground [m]."""
    inner = 0.8 * radius * _circle()
    outer = radius * _circle()
    _, _, wall = _extrude(outer, length)
    _, _, bore = _extrude(inner, length)
    rims = [_strip(_at(outer, z), _at(inner, z)) for z in (0.0, length)]
    body = _lay_down(np.concatenate([*wall, *bore, *rims]), length, radius)
    return [Patch(body, policy.obstacle(support + 2 * radius))]


def tube(length: float, radius: float, policy: LabelPolicy, support: float = 0.0) -> list[Patch]:
    """A closed bar along x whose lowest line is on z = 0 [m]; ``support``: height of that line above the ground [m]."""
    top, bottom, sides = _extrude(radius * _circle(), length)
    body = _lay_down(np.concatenate([top, bottom, *sides]), length, radius)
    return [Patch(body, policy.obstacle(support + 2 * radius))]


def floor(height, cell: float = 0.1) -> list[Patch]:
    """A floor of 4 m x 4 m around the origin, z = ``height(x, y)`` [m] (vectorised); steppable everywhere."""
    ticks = np.linspace(-0.5 * FLOOR_SIZE, 0.5 * FLOOR_SIZE, round(FLOOR_SIZE / cell) + 1)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    grid = np.stack([x, y, height(x, y)], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    halves = [np.stack(corners, axis=2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))]
    return [Patch(np.concatenate(halves), Steppability.STEPPABLE)]


def rectangle(corners, label: Steppability) -> Patch:
    """A flat quadrilateral with four ``corners`` in order [m]."""
    a, b, c, d = corners
    return Patch(_triangles([(a, b, c), (a, c, d)]), label)


def sample_size(name: str, rng: np.random.Generator) -> dict:
    """Draws the parameters of the shape ``name`` [m], uniformly from SIZE_RANGES; ramps only up to 30 degrees."""
    while True:
        size = {key: rng.uniform(*limits) for key, limits in SIZE_RANGES[name].items()}
        if name != "ramp" or size["height"] <= math.tan(math.radians(30)) * size["length"]:
            return size


def make_shape(name: str, size: dict, policy: LabelPolicy, support: float = 0.0) -> list[Patch]:
    """Returns one of the shapes by its name in SIZE_RANGES (not the floor), with its own frame as W."""
    if name in ("cuboid", "ramp"):
        return (cuboid if name == "cuboid" else ramp)((size["length"], size["width"], size["height"]), policy)
    if name == "cylinder":
        return cylinder(size["radius_x"], size["radius_y"], size["height"], policy)
    makers = {"sphere": sphere, "semisphere": semisphere, "pole": pole, "pipe": pipe, "tube": tube}
    return makers[name](**size, policy=policy, support=support)


def _triangles(corners) -> np.ndarray:
    return np.array(corners, float).reshape(-1, 3, 3)


def _circle() -> np.ndarray:
    angles = np.arange(SIDES) * (2 * math.pi / SIDES)
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _at(polygon: np.ndarray, z: float) -> np.ndarray:
    return np.column_stack([polygon, np.full(len(polygon), z)])


def _strip(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Triangles between two closed rings of points, (2 n, 3, 3)."""
    low_next, high_next = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
    return np.concatenate([np.stack([low, low_next, high_next], 1), np.stack([low, high_next, high], 1)])


def _extrude(polygon: np.ndarray, height: float):
    """Top, bottom and the list of side faces of the upright prism over a convex ``polygon`` (n, 2), from z = 0."""
    n = len(polygon)
    low, high = _at(polygon, 0.0), _at(polygon, height)
    fan = [(0, i, i + 1) for i in range(1, n - 1)]
    strip = _strip(low, high)
    return high[fan], low[fan], [strip[[i, n + i]] for i in range(n)]


def _dome(radius: float, lowest: float, rings: int = 8) -> np.ndarray:
    """Triangles of a ball around the origin from the latitude ``lowest`` [rad] upwards."""
    latitudes = np.linspace(lowest, 0.5 * math.pi, rings + 1)
    layers = [_at(radius * math.cos(a) * _circle(), radius * math.sin(a)) for a in latitudes]
    return np.concatenate([_strip(a, b) for a, b in pairwise(layers)])


def _lay_down(triangles: np.ndarray, length: float, radius: float) -> np.ndarray:
    """Turns what stands along z from 0 to ``length`` so that it lies along x, centred, lowest line on z = 0."""
    x, y, z = triangles[..., 0], triangles[..., 1], triangles[..., 2]
    return np.stack([z - 0.5 * length, y, radius - x], axis=-1)
