"""Regions as padded arrays, and the polygon queries that a search asks of them."""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.values.regions import PlanarRegion
from quadpips_drake.values.steppability import Steppability


class RegionTable(NamedTuple):
    """``n`` regions whose inset polygons are padded to ``m`` vertices; a NamedTuple, so that numba takes it as it is."""

    origins: np.ndarray
    """Origins of the region frames in W [m], (n, 3)."""
    rotations: np.ndarray
    """Axes of the region frames in W, (n, 3, 3)."""
    insets: np.ndarray
    """Inset polygons in the region frames [m], counter-clockwise, (n, m, 2); spare rows repeat the first one."""
    counts: np.ndarray
    """Vertices of each inset, int64 (n,)."""
    radii: np.ndarray
    """Largest distance of a vertex from the origin [m], (n,)."""


def may_carry_a_foot(region: PlanarRegion, max_slope: float, every_label: bool = False) -> bool:
    """Whether slope [rad], inset polygon and label (any if ``every_label``) of ``region`` allow a foothold."""
    steppable = every_label or region.label in (Steppability.UNKNOWN, Steppability.STEPPABLE)
    return steppable and len(region.inset) >= 3 and float(region.normal[2]) >= np.cos(max_slope)


def make_region_table(regions) -> RegionTable:
    """Packs a sequence of PlanarRegions."""
    return _packed(regions, [region.inset for region in regions])


def outline_table(regions) -> RegionTable:
    """Packs a sequence of PlanarRegions with their boundaries in the place of the insets: where there is ground at all."""
    return _packed(regions, [region.boundary for region in regions])


def _packed(regions, polygons) -> RegionTable:
    n = len(regions)
    m = max((len(polygon) for polygon in polygons), default=1)
    padded = np.zeros((n, m, 2))
    for k, polygon in enumerate(polygons):
        padded[k, : len(polygon)] = polygon
        padded[k, len(polygon) :] = polygon[0]
    return RegionTable(
        origins=np.array([region.X_WR[:3, 3] for region in regions], dtype=float).reshape(n, 3),
        rotations=np.array([region.X_WR[:3, :3] for region in regions], dtype=float).reshape(n, 3, 3),
        insets=padded,
        counts=np.array([len(polygon) for polygon in polygons], dtype=np.int64),
        radii=np.linalg.norm(padded, axis=2).max(axis=1, initial=0.0),
    )


@njit(cache=True)
def nearest_in_polygon(u, v, polygon, count):
    """Returns the point of a convex polygon nearest to (u, v), and whether (u, v) itself is inside.

    The polygon is counter-clockwise, the first ``count`` rows of ``polygon``.
    """
    inside = True
    best_u, best_v, best = u, v, np.inf
    for i in range(count):
        j = (i + 1) % count
        au, av = polygon[i, 0], polygon[i, 1]
        eu, ev = polygon[j, 0] - au, polygon[j, 1] - av
        if eu * (v - av) - ev * (u - au) < 0.0:
            inside = False
        length_squared = eu * eu + ev * ev
        along = 0.0
        if length_squared > 0.0:
            along = min(1.0, max(0.0, (eu * (u - au) + ev * (v - av)) / length_squared))
        pu, pv = au + along * eu, av + along * ev
        distance = (pu - u) ** 2 + (pv - v) ** 2
        if distance < best:
            best_u, best_v, best = pu, pv, distance
    if inside:
        return u, v, True
    return best_u, best_v, False


@njit(cache=True)
def foothold_near(table, k, x, y, inward):
    """Returns the foothold (x, y, z) of region ``k`` in W nearest to the point of its plane above or below (x, y).

    A point that had to be moved onto the inset's border goes on by as much, up to ``inward`` [m], towards the origin of the
    region (at most half the way), away from the edge.
    """
    origin, R = table.origins[k], table.rotations[k]
    dx, dy = x - origin[0], y - origin[1]
    dz = -(R[0, 2] * dx + R[1, 2] * dy) / R[2, 2]
    u = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz
    v = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz
    wanted_u, wanted_v = u, v
    u, v, inside = nearest_in_polygon(u, v, table.insets[k], table.counts[k])
    if not inside:
        reach = np.hypot(u, v)
        if reach > 1e-9:
            scale = 1.0 - min(min(inward, np.hypot(wanted_u - u, wanted_v - v)) / reach, 0.5)
            u, v = u * scale, v * scale
    return (
        origin[0] + R[0, 0] * u + R[0, 1] * v,
        origin[1] + R[1, 0] * u + R[1, 1] * v,
        origin[2] + R[2, 0] * u + R[2, 1] * v,
    )


def in_convex_polygon(points, polygon, tolerance=0.0):
    """Whether points (..., 2) lie in the convex counter-clockwise ``polygon`` (n, 2), or within ``tolerance`` [m] of it."""
    edges = np.concatenate((polygon[1:], polygon[:1])) - polygon
    offsets = np.asarray(points)[..., None, :] - polygon
    cross = edges[:, 0] * offsets[..., 1] - edges[:, 1] * offsets[..., 0]
    return np.all(cross >= -tolerance * np.linalg.norm(edges, axis=1), axis=-1)
