"""Ground that has risen while the robot walked: it may go on to move, so no foot stands on it or close to it."""

from dataclasses import replace

import numpy as np
import shapely
from scipy.ndimage import maximum_filter

from quadpips_drake.values.regions import GroundHeights, PlanarRegion, RegionSet

_SAME_SURFACE = 0.02
"""A point this near to the plane of a region is part of it [m]."""
_LEAST_POINTS = 10
"""Fewer points may be noise."""
_TOGETHER = 0.03
"""Points this near to each other are of one thing [m]."""
_FAR = 100.0
"""Beyond all regions [m]."""
_HIDDEN = 0.5
"""A strip of ground goes on being part of a thing if at least this part of it was not seen since [1]."""
SWING_ROOM = 0.12
"""The straight way of a swing keeps so far away from it [m]; feet were measured up to 10 cm beside theirs."""
_WIDENED, _RAISED = 0.04, 0.025
"""Swings clear it as if it were so much wider and higher [m]."""


def without_appeared(regions: RegionSet, points: np.ndarray, keep_off: float) -> RegionSet:
    """The regions without those on which something lies that has appeared, and cut off beside it.

    Args:
        regions: what is known.
        points: on top of what has appeared, in W [m], (n, 3).
        keep_off: how far away from it feet stay [m].
    """
    things = outlines(points, keep_off)
    if not things:
        return regions
    kept = []
    for region in regions.regions:
        if _count_on(region, points) < _LEAST_POINTS:
            region = _beside(region, things)
            if len(region.inset):
                kept.append(region)
    return RegionSet(regions.stamp, tuple(kept))


def with_hidden_side(points: np.ndarray, before: GroundHeights, now: GroundHeights, yaw: float) -> np.ndarray:
    """``points`` with those of the near side of each thing that no camera has seen.

    A camera in front sees nothing of the ground just before the robot. What reaches into there is seen in part, and of the
    rest the map goes on to say what it said before. A thing is taken to be as deep along the robot's heading as it is wide,
    as far as the map has not changed at all on its near side since then: where an image shows ground, its height changes.

    Args:
        points: on top of what has appeared, in W [m], (n, 3).
        before, now: the map before it appeared, and when the points were seen.
        yaw: of the robot [rad].
    """
    found = [points]
    toward = -np.array([np.cos(yaw), np.sin(yaw)])  # from the thing to the robot
    aside = np.array([-toward[1], toward[0]])
    for thing in outlines(points, 0.0):
        top = points[shapely.contains_xy(thing, *points[:, :2].T)]
        near, across = top[:, :2] @ toward, top[:, :2] @ aside
        deeper = np.ptp(across) - np.ptp(near)
        strips = near.max() + now.cell * np.arange(1, int(deeper / now.cell) + 1)
        for along in strips:
            row = np.arange(across.min(), across.max() + 0.5 * now.cell, now.cell)
            xy = along * toward + row[:, None] * aside
            height = now.at(*xy.T)
            hidden = np.isnan(height) | (height == before.at(*xy.T))
            if hidden.mean() < _HIDDEN:
                break
            found.append(np.column_stack((xy, np.full(len(xy), top[:, 2].max())))[hidden])
    return np.concatenate(found)


def with_margin(heights: GroundHeights, points: np.ndarray) -> GroundHeights:
    """The map with what has appeared at ``points`` (n, 3) in W [m] a little wider and higher, for swings."""
    cells = np.floor((points[:, :2] - heights.corner) / heights.cell).astype(int).reshape(-1, 2)
    inside = ((cells >= 0) & (cells < heights.height.shape)).all(axis=1)
    if inside.sum() < _LEAST_POINTS:
        return heights
    tops = np.full(heights.height.shape, -np.inf, np.float32)
    np.maximum.at(tops, tuple(cells[inside].T), points[inside, 2].astype(np.float32))
    tops = maximum_filter(tops, 2 * round(_WIDENED / heights.cell) + 1, mode="constant", cval=-np.inf) + np.float32(_RAISED)
    return replace(heights, height=np.fmax(heights.height, np.where(np.isfinite(tops), tops, np.float32(np.nan))))


def lead_over(things: list[shapely.Polygon], legs, start: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Which transitions have a swing whose straight way leads over one of the outlines of ``things``, bool (k,).

    Args:
        things: what ``outlines`` returns.
        legs: that swing.
        start: ground points of the feet before [m], (4, 3).
        ends: ... and after each transition [m], (k, 4, 3).
    """
    over = np.zeros(len(ends), dtype=bool)
    for leg in map(int, legs):
        ways = np.stack((np.broadcast_to(start[leg, :2], (len(ends), 2)), ends[:, leg, :2]), axis=1)
        for thing in things:
            if not shapely.contains_xy(thing, *start[leg, :2]):  # from where it stands already it has to get away
                over |= shapely.intersects(thing, shapely.linestrings(ways))
    return over


def outlines(points: np.ndarray, keep_off: float) -> list[shapely.Polygon]:
    """What feet keep off: the convex hull around each thing, widened by ``keep_off`` [m], in x and y of W."""
    if len(points) < _LEAST_POINTS:
        return []
    union = shapely.union_all(shapely.buffer(shapely.points(points[:, :2]), 0.5 * _TOGETHER, quad_segs=1))
    things = [
        part for part in shapely.get_parts(union) if shapely.contains_xy(part, *points[:, :2].T).sum() >= _LEAST_POINTS
    ]
    return [shapely.buffer(thing.convex_hull, max(keep_off - 0.5 * _TOGETHER, 0.0), quad_segs=2) for thing in things]


def _count_on(region: PlanarRegion, points: np.ndarray) -> int:
    """How many points lie on the region."""
    local = (points - region.X_WR[:3, 3]) @ region.X_WR[:3, :3]
    local = local[np.abs(local[:, 2]) <= _SAME_SURFACE]
    return int(shapely.contains_xy(shapely.Polygon(region.boundary), *local[:, :2].T).sum())


def _beside(region: PlanarRegion, things: list[shapely.Polygon]) -> PlanarRegion:
    """The region with an inset, still convex, that none of the things reaches into; empty if little is left."""
    inset = region.inset
    for thing in things:
        corners = shapely.get_coordinates(thing.exterior)[:-1]
        ahead = np.column_stack((corners - region.X_WR[:2, 3], np.zeros(len(corners))))
        # Along the vertical onto the region's plane.
        ahead[:, 2] = -(ahead[:, :2] @ region.X_WR[:2, 2]) / region.X_WR[2, 2]
        outline = shapely.Polygon((ahead @ region.X_WR[:3, :3])[:, :2])
        if len(inset) >= 3 and shapely.intersects(outline, shapely.Polygon(inset)):
            inset = _largest_part_outside(inset, shapely.get_coordinates(outline.normalize().exterior)[::-1][:-1])
    return region if inset is region.inset else replace(region, inset=inset)


def _largest_part_outside(polygon: np.ndarray, obstacle: np.ndarray) -> np.ndarray:
    """The largest part of ``polygon`` (n, 2) beyond one of the edges of the convex counter-clockwise ``obstacle`` (m, 2)."""
    best, largest = np.zeros((0, 2)), 0.0
    for start, end in zip(obstacle, np.roll(obstacle, -1, axis=0), strict=True):
        along = (end - start) / max(np.linalg.norm(end - start), 1e-9)
        outward = np.array([along[1], -along[0]])
        sideways, forth = _FAR * along, _FAR * outward
        beyond = shapely.Polygon([start - sideways, start - sideways + forth, start + sideways + forth, start + sideways])
        part = shapely.intersection(beyond, shapely.Polygon(polygon))
        if part.geom_type == "Polygon" and part.area > largest:
            largest = part.area
            best = shapely.get_coordinates(shapely.orient_polygons(part).exterior)[:-1]
    return best
