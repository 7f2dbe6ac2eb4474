"""Regions and robots for the tests of the baselines."""

import numpy as np

from quadpips_drake.math.polygons import convex_hull, shrink
from quadpips_drake.values.regions import PlanarRegion, RegionSet


def region(number: int, center, size, slope=(0.0, 0.0), margin: float = 0.03) -> PlanarRegion:
    """A rectangle ``size`` [m] about ``center`` whose plane rises by ``slope`` along x and y."""
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
    x = np.cross([0.0, 1.0, 0.0], normal)
    X_WR = np.eye(4)
    X_WR[:3, 0], X_WR[:3, 2], X_WR[:3, 3] = x / np.linalg.norm(x), normal, center
    X_WR[:3, 1] = np.cross(normal, X_WR[:3, 0])
    boundary = 0.5 * np.array(size) * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    return PlanarRegion(number, X_WR, boundary, shrink(boundary, margin))


def floor(height: float = 0.0, side: float = 6.0) -> RegionSet:
    """One large region."""
    return RegionSet(0.0, (region(0, (0.0, 0.0, height), (side, side)),))


def random_polygon(rng: np.random.Generator, radius: float = 0.3) -> np.ndarray:
    """A convex polygon (n, 2) around a point near the origin."""
    return convex_hull(rng.uniform(-radius, radius, (rng.integers(4, 12), 2)))


def random_region(rng: np.random.Generator, number: int) -> PlanarRegion:
    """Anywhere within half a metre, inclined by up to some 30 degrees."""
    while True:
        boundary = random_polygon(rng)
        inset = shrink(boundary, 0.02)
        if len(inset) >= 3:
            plane = region(number, rng.uniform(-0.5, 0.5, 3), (1.0, 1.0), rng.uniform(-0.5, 0.5, 2))
            return PlanarRegion(number, plane.X_WR, boundary, inset)
