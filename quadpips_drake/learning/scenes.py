"""Random scenes of the steppability data (QuadPiPS section V-B.3 and V-B.5): what stands where, and where a robot walks."""

import math
from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.learning import primitives
from quadpips_drake.learning.primitives import FLOOR_SIZE, LabelPolicy, Patch, make_shape, rectangle, sample_size
from quadpips_drake.terrain.terrain import pose
from quadpips_drake.values.steppability import Steppability

HORIZON = 12.0
"""Half the width of the ground outdoors [m]; further than any camera here sees."""


@dataclass
class Scene:
    """Labelled surfaces, and the way along which a robot's base goes over them."""

    kind: str
    policy: LabelPolicy
    patches: list[Patch] = field(default_factory=list)
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """x, y [m] and yaw [rad] of the base at the first frame."""

    def add(self, patches: list[Patch], xyz=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)) -> None:
        """Adds ``patches``, given in a frame at ``xyz`` [m] with roll, pitch, yaw ``rpy`` [rad]."""
        X_WP = pose(xyz, rpy)
        self.patches += [patch.moved(X_WP) for patch in patches]

    def add_box(self, x, y, top: float, size, drops=None, rpy=(0.0, 0.0, 0.0)) -> None:
        """Adds a cuboid of ``size`` whose top is at height ``top``, centred at ``x``, ``y`` [m]."""
        self.add(primitives.cuboid(size, self.policy, drops), (x, y, top - size[2]), rpy)

    def triangles(self, label: Steppability) -> np.ndarray:
        """Returns all triangles with that ``label``, (n, 3, 3) in W [m]."""
        chosen = [patch.triangles for patch in self.patches if patch.label == label]
        return np.concatenate(chosen) if chosen else np.zeros((0, 3, 3))


def make_scene(rng: np.random.Generator, policy: LabelPolicy) -> Scene:
    """Draws a scene; its kind is drawn from SCENE_KINDS by weight."""
    names = list(SCENE_KINDS)
    weights = np.array([weight for _, weight in SCENE_KINDS.values()], float)
    kind = names[rng.choice(len(names), p=weights / weights.sum())]
    return make_scene_of_kind(kind, rng, policy)


def make_scene_of_kind(kind: str, rng: np.random.Generator, policy: LabelPolicy) -> Scene:
    """Draws a scene of one of SCENE_KINDS; indoors (walls and ceiling) or outdoors by a coin."""
    scene = Scene(kind, policy)
    SCENE_KINDS[kind][0](scene, rng)
    if rng.random() < 0.5:
        _add_room(scene, rng)
    return scene


def _scattered(scene: Scene, rng) -> None:
    """Shapes all over a wavy floor."""
    _place_shapes(scene, rng, _add_floor(scene, rng), rng.integers(10, 32), (0.2, 0.0), 1.7)
    scene.start = (rng.uniform(-1.7, -0.4), rng.uniform(-0.6, 0.6), rng.normal(0, 0.4))


def _cluster(scene: Scene, rng) -> None:
    """Shapes close together."""
    center = rng.uniform(-0.4, 0.5, 2)
    _place_shapes(scene, rng, _add_floor(scene, rng), rng.integers(12, 30), center, 0.9)
    scene.start = (center[0] - rng.uniform(0.6, 1.6), center[1] + rng.normal(0, 0.2), rng.normal(0, 0.25))


def _bare_floor(scene: Scene, rng) -> None:
    """Nothing but a wavy floor."""
    _add_floor(scene, rng)
    scene.start = (rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-math.pi, math.pi))


def _stairs(scene: Scene, rng) -> None:
    """Stairs to a platform; the robot walks up or down."""
    _add_apron(scene, 0.0)
    steps, rise = rng.integers(3, 11), rng.uniform(0.04, 0.19)
    run, width = rng.uniform(0.20, 0.40), rng.uniform(1.0, 3.0)
    thickness = rise if rng.random() < 0.5 else None
    for i in range(steps):
        top = rise * (i + 1)
        scene.add_box(run * (i + 0.5), 0, top, (run, width, thickness or top), drops=[top, top, rise, top])
    end, top = run * steps, rise * steps
    scene.add_box(end + 1.0, 0, top, (2.0, width, thickness or top), drops=[top, top, rise, top])
    if rng.random() < 0.75:
        scene.start = (rng.uniform(-1.2, max(end - 1.2, -0.4)), rng.uniform(-0.3, 0.3), rng.normal(0, 0.15))
    else:
        scene.start = (end + rng.uniform(0.2, 1.2), rng.uniform(-0.3, 0.3), math.pi + rng.normal(0, 0.15))


def _stones(scene: Scene, rng) -> None:
    """Stones in a pit between two platforms, on a regular or thinned grid."""
    length, depth = rng.uniform(1.0, 2.5), _add_pit(scene, rng)
    _add_platforms(scene, length, depth)
    size, gap = rng.uniform(0.13, 0.40), rng.uniform(0.0, 0.25)
    thin = rng.random() < 0.4
    keep, level = (rng.uniform(0.35, 0.8) if thin else 1.0), rng.uniform(0, 0.06) * (rng.random() < 0.6)
    turn, is_round = rng.uniform(0, 0.3) * (rng.random() < 0.4), rng.random() < 0.25
    pitch = size + (0.0 if thin and rng.random() < 0.5 else gap)
    height = 0.1 if rng.random() < 0.4 else depth
    rows = max(int((length - gap) // pitch), 1)
    for row in range(rows):
        for column in range(max(int(3.0 // pitch), 2)):
            if rng.random() > keep:
                continue
            x, y = length / 2 + pitch * (row - (rows - 1) / 2), pitch * column - 1.5
            top = rng.uniform(-level, level)
            if is_round:
                stone = primitives.cylinder(size / 2, size / 2, height, scene.policy, drop=depth)
                scene.add(stone, (x, y, top - height))
            else:
                box = (size, size, height)
                scene.add_box(x, y, top, box, drops=[depth] * 4, rpy=(0, 0, rng.uniform(-turn, turn)))
    scene.start = _start_at_gap(length, rng)


def _beam(scene: Scene, rng) -> None:
    """A beam over a pit between two platforms, at times with low barriers on it."""
    length, depth = rng.uniform(1.0, 2.5), _add_pit(scene, rng)
    _add_platforms(scene, length, depth)
    offsets = (0.0,) if rng.random() < 0.6 else (-0.45, 0.45)
    width = rng.uniform(0.2, 0.6)
    for y in offsets:
        scene.add_box(length / 2, y, 0.0, (length, width, 0.1), drops=[depth] * 4)
        for _ in range(rng.integers(0, 3)):
            size = (rng.uniform(0.05, 0.12), width, rng.uniform(0.05, 0.25))
            scene.add_box(rng.uniform(0.1, length - 0.1), y, size[2], size, rpy=(0, 0, rng.normal(0, 0.2)))
    scene.start = _start_at_gap(length, rng)


def _blocks(scene: Scene, rng) -> None:
    """Blocks side by side at different heights, like a pegboard."""
    _add_apron(scene, 0.0)
    edge, columns, rows = rng.uniform(0.2, 0.4), 8, 8
    ridge = rng.uniform(0.0, 0.06) * np.minimum(np.arange(columns), columns - 1 - np.arange(columns))
    tops = 0.03 + ridge[:, None] + rng.uniform(0, rng.uniform(0.03, 0.2), (columns, rows))
    around = np.pad(tops, 1)
    for i in range(columns):
        for j in range(rows):
            neighbours = [around[i + 2, j + 1], around[i + 1, j + 2], around[i, j + 1], around[i + 1, j]]
            top = tops[i, j]
            drops = [max(top - other, 0.0) for other in neighbours]
            scene.add_box(edge * i, edge * (j - rows / 2 + 0.5), top, (edge, edge, top), drops)
    scene.start = (rng.uniform(-1.2, 1.0), rng.uniform(-0.5, 0.5), rng.normal(0, 0.25))


def _rubble(scene: Scene, rng) -> None:
    """Tilted slabs, half sunk into the ground."""
    height = _add_floor(scene, rng)
    pitch, tilt = rng.uniform(0.25, 0.45), rng.uniform(0.05, 0.22)
    for x in np.arange(-0.6, 1.9, pitch):
        for y in np.arange(-1.5, 1.5, pitch):
            if rng.random() < 0.15:
                continue
            at = (x + rng.uniform(-0.03, 0.03), y + rng.uniform(-0.03, 0.03))
            size = (*(pitch * rng.uniform(0.75, 1.0, 2)), 0.12)
            top = float(height(*at)) + rng.uniform(0.04, 0.08)
            rpy = (*rng.uniform(-tilt, tilt, 2), rng.uniform(-0.2, 0.2))
            scene.add_box(*at, top, size, rpy=rpy)
    scene.start = (rng.uniform(-1.6, 0.2), rng.uniform(-0.5, 0.5), rng.normal(0, 0.25))


def _slope(scene: Scene, rng) -> None:
    """A long ramp to a platform; the robot walks up or down."""
    _add_apron(scene, 0.0)
    angle, length, width = rng.uniform(0.08, 0.45), rng.uniform(1.0, 3.0), rng.uniform(1.0, 3.0)
    height = length * math.tan(angle)
    lip = rng.uniform(0.0, 0.06) * (rng.random() < 0.5)
    scene.add(primitives.ramp((length, width, height), scene.policy), (0.5 * length, 0, lip))
    if lip > 0:
        scene.add_box(0.5 * length, 0, lip, (length, width, lip), drops=[lip] * 4)
    top = lip + height
    scene.add_box(length + 1.0, 0, top, (2.0, width, top), drops=[top] * 4)
    if rng.random() < 0.6:
        scene.start = (rng.uniform(-1.3, length), rng.uniform(-0.3, 0.3), rng.normal(0, 0.2))
    else:
        scene.start = (length + rng.uniform(0.2, 1.2), rng.uniform(-0.3, 0.3), math.pi + rng.normal(0, 0.2))


SCENE_KINDS = {
    "scattered": (_scattered, 24),
    "cluster": (_cluster, 18),
    "bare_floor": (_bare_floor, 2),
    "stairs": (_stairs, 18),
    "stones": (_stones, 14),
    "beam": (_beam, 5),
    "blocks": (_blocks, 9),
    "rubble": (_rubble, 7),
    "slope": (_slope, 5),
}
"""What makes a kind of scene, and how often it is drawn."""


def _add_floor(scene: Scene, rng):
    """Adds a wavy floor with level ground around it; returns its height function."""
    waves = []
    if rng.random() < 0.6:
        for _ in range(rng.integers(1, 4)):
            wavelength, direction = rng.uniform(0.8, 3.0), rng.uniform(0, math.pi)
            k = 2 * math.pi / wavelength * np.array([math.cos(direction), math.sin(direction)])
            # The amplitude is bounded through the slope, so that all of it can be stepped on.
            waves.append((rng.uniform(0.0, 0.15) / (2 * math.pi) * wavelength, k, rng.uniform(0, 2 * math.pi)))

    def height(x, y):
        x, y = np.asarray(x, float), np.asarray(y, float)
        z = sum((a * np.sin(k[0] * x + k[1] * y + phase) for a, k, phase in waves), np.zeros_like(x))
        # Level at the border, where the ground outside begins.
        to_border = 0.5 * FLOOR_SIZE - np.maximum(np.abs(x), np.abs(y))
        return z * np.clip(to_border / 0.5, 0, 1)

    scene.add(primitives.floor(height))
    _add_apron(scene, 0.0, 0.5 * FLOOR_SIZE)
    return height


def _add_apron(scene: Scene, z: float, inside: float = 0.0) -> None:
    """Adds level ground at height ``z`` to the horizon, with a square hole of half width ``inside`` [m]."""
    a, b = HORIZON, inside
    for x0, x1, y0, y1 in ((-a, -b, -a, a), (b, a, -a, a), (-b, b, -a, -b), (-b, b, b, a)):
        if x1 > x0 and y1 > y0:
            corners = [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]
            scene.patches.append(rectangle(corners, Steppability.STEPPABLE))


def _add_pit(scene: Scene, rng) -> float:
    """Adds a pit floor, or none in a third of the cases; returns its depth [m]. Nobody shall step down there."""
    depth = rng.uniform(0.4, 1.2)
    if rng.random() < 0.67:
        a = HORIZON
        corners = [(-a, -a, -depth), (a, -a, -depth), (a, a, -depth), (-a, a, -depth)]
        scene.patches.append(rectangle(corners, Steppability.NON_PASSABLE))
    return depth


def _add_platforms(scene: Scene, length: float, depth: float) -> None:
    """Platforms with tops at z = 0 on either side of a pit from x = 0 to ``length``."""
    size = (3.0, 5.0, depth)
    scene.add_box(-1.5, 0, 0.0, size, drops=[depth] * 4)
    scene.add_box(length + 1.5, 0, 0.0, size, drops=[depth] * 4)


def _start_at_gap(length: float, rng) -> tuple[float, float, float]:
    return (rng.uniform(-1.2, 0.5 * length), rng.uniform(-0.4, 0.4), rng.normal(0, 0.2))


def _place_shapes(scene: Scene, rng, height, count: int, center, spread: float) -> None:
    """Puts ``count`` shapes on the floor ``height(x, y)``, apart from each other; small ones at times on big ones."""
    occupied: list[tuple[float, float, float]] = []
    names = [name for name in primitives.SIZE_RANGES if name != "floor"]
    for _ in range(6 * count):
        name = names[rng.integers(len(names))]
        size = sample_size(name, rng)
        extent = _extent(size)
        x, y = np.clip(np.asarray(center) + rng.uniform(-spread, spread, 2), -1.9, 1.9)
        if any(math.hypot(x - a, y - b) < 0.85 * (extent + c) for a, b, c in occupied):
            continue
        occupied.append((x, y, extent))
        ground = float(height(x, y))
        _place(scene, rng, name, size, (x, y, ground), 0.0)
        if name in ("cuboid", "cylinder") and rng.random() < 0.3:
            small = ("sphere", "semisphere", "pole", "pipe")[rng.integers(4)]
            _place(scene, rng, small, sample_size(small, rng), (x, y, ground + size["height"]), size["height"])
        if len(occupied) >= count:
            return


def _place(scene: Scene, rng, name: str, size: dict, xyz, support: float) -> None:
    """Adds one shape on ``xyz`` with any heading; pipes and tubes may hang in the air instead."""
    x, y, z = xyz
    rpy = [0.0, 0.0, rng.uniform(-math.pi, math.pi)]
    if name in ("pipe", "tube") and rng.random() < 0.4:
        lift = rng.uniform(0.02, 0.5)
        z, support = z + lift, support + lift
        rpy[1] = rng.uniform(-0.3, 0.3)
    # Sunk by a trifle, so that no gap opens over a floor that is not level.
    scene.add(make_shape(name, size, scene.policy, support), (x, y, z - 0.005), rpy)


def _extent(size: dict) -> float:
    """A radius around a shape that others keep out of [m]."""
    if "width" in size:
        return 0.5 * math.hypot(size["length"], size["width"])
    return max(size.get("radius_x", 0.0), size.get("radius_y", 0.0), 0.6 * size.get("length", 0.0), size.get("radius", 0.0))


def _add_room(scene: Scene, rng) -> None:
    """Walls and a ceiling around the scene; nothing there can be stepped on or over."""
    points = np.concatenate([patch.triangles.reshape(-1, 3) for patch in scene.patches])
    inner = points[np.abs(points[:, :2]).max(axis=1) < HORIZON - 1]
    low, high = (inner.min(axis=0), inner.max(axis=0)) if len(inner) else (np.full(3, -2.0), np.full(3, 2.0))
    x0, y0 = np.minimum(low[:2], -1.5) - rng.uniform(0.0, 1.0, 2)
    x1, y1 = np.maximum(high[:2], 1.5) + rng.uniform(0.0, 1.0, 2)
    z0, z1 = points[:, 2].min() - 0.1, max(high[2], 0.0) + rng.uniform(2.2, 3.0)
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    for (xa, ya), (xb, yb) in zip(ring, ring[1:] + ring[:1], strict=True):
        corners = [(xa, ya, z0), (xb, yb, z0), (xb, yb, z1), (xa, ya, z1)]
        scene.patches.append(rectangle(corners, Steppability.NON_PASSABLE))
    ceiling = [(x, y, z1) for x, y in ring]
    scene.patches.append(rectangle(ceiling, Steppability.NON_PASSABLE))
