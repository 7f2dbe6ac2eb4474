"""Spheres on level ground, drawn by the seed."""

import numpy as np

from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import ground
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Sphere, Terrain, pose
from quadpips_drake.values.steppability import Steppability

_FIELD = 3.0
"""Length and width of the ground on which they lie [m]."""
_RADII = (0.04, 0.14)
_APART = 0.05
"""Least distance between two of them [m]."""
_STEPPED_OVER = 0.15
"""Higher ones are not passable [m]: the largest height of a swing in QuadPiPS' data set."""


@takes_difficulty("count", "number of spheres", "1", low=0.0, high=60.0)
def boulders(*, seed: int = 0, count: float = 20) -> Terrain:
    """Spheres on level ground, to be stepped over or walked around.

    ``count`` of them, 8 to 28 cm high, lie on a square of 3 m, drawn by ``seed``; one that would touch another is left out.
    Those up to 15 cm high are labelled passable, the others non-passable.
    """
    rng = np.random.default_rng(seed)
    spheres: list[Sphere] = []
    for k in range(round(count)):
        radius = rng.uniform(*_RADII)
        center = np.array([*rng.uniform([0.0, -0.5 * _FIELD], [_FIELD, 0.5 * _FIELD]), radius])
        if all(np.linalg.norm(center - s.X_WE[:3, 3]) >= radius + s.radius + _APART for s in spheres):
            label = Steppability.PASSABLE if 2 * radius <= _STEPPED_OVER else Steppability.NON_PASSABLE
            spheres.append(Sphere(name=f"sphere_{k}", radius=radius, X_WE=pose(center), label=label))
    return Terrain("boulders", (-1.2, 0, 0), (_FIELD + 1.2, 0), DEFAULT_FRICTION, (ground(14.0), *spheres))
