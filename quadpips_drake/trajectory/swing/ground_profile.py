"""The ground below a swing, from what is known of it: how high the foot has to be where."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from quadpips_drake.values.regions import GroundHeights

SAMPLES = 25
"""Equal parts of the way [1]: 0 at lift-off, 1 at touch-down."""
PARTS = np.linspace(0.0, 1.0, SAMPLES)
"""Where on the way of a swing its profile has samples [1]."""
_STEP = 0.02
"""A height difference between both ends of more than this [m] is taken for a step, not for a slope."""
_LATEST_EDGE = 0.25
"""Where nothing is known, the edge of a step lies this part of the way or farther from the lower foothold [1]."""


_ASIDE = 0.01
"""A foot keeps this far from what is beside its way, too [m]."""


@dataclass(frozen=True, eq=False)
class KnownGround:
    """What is known of the ground that swings pass over."""

    regions: tuple = ()
    """PlanarRegions; they count where there are no heights."""
    heights: GroundHeights | None = None
    """Of steppable ground and of all other."""

    def profile(self, p0, p1, foot_radius: float) -> np.ndarray:
        """``ground_profile`` of a way."""
        centers, extents = self._outlines
        middle = 0.5 * (np.asarray(p0) + np.asarray(p1))
        reach = 0.5 * float(np.hypot(p1[0] - p0[0], p1[1] - p0[1])) + foot_radius
        near = np.flatnonzero(np.hypot(*(centers - middle[:2]).T) < reach + extents)
        return ground_profile(p0, p1, [self.regions[k] for k in near], foot_radius, self.heights)

    @cached_property
    def _outlines(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres x, y (n, 2) and radii (n,) of circles around the regions [m]."""
        centers = np.array([region.X_WR[:2, 3] for region in self.regions]).reshape(-1, 2)
        return centers, np.array([np.hypot(*region.boundary.T).max() for region in self.regions])


def ground_profile(p0, p1, regions=(), foot_radius: float = 0.0, heights: GroundHeights | None = None) -> np.ndarray:
    """Lowest admissible heights of the foot centre on the straight way from ``p0`` to ``p1``, (SAMPLES,) [m] in W.

    Where the map of heights knows the ground, a sphere a little wider than the foot has to clear it. Elsewhere known regions
    count, widened by the foot's radius; where nothing is known, a step is expected between ends at different heights that
    lies as close to the lower one as is likely.

    Args:
        p0, p1: foot centres at lift-off and touch-down [m], (3,).
        regions: PlanarRegions around the way; others do not matter.
        foot_radius: [m].
        heights: of the ground around the way; None: unknown.
    """
    p0, p1 = np.array(p0, dtype=float), np.array(p1, dtype=float)
    profile, is_known = np.full(SAMPLES, -np.inf), np.zeros(SAMPLES, dtype=bool)
    if heights is not None and heights.height.size:
        corner, cell = np.array(heights.corner, float), float(heights.cell)
        _take_heights(corner, cell, heights.height, foot_radius, p0, p1, profile, is_known)
    if not is_known.all():
        for region in regions:
            _raise_over(*_outline(region), foot_radius, p0, p1, profile, is_known)
    known = len(regions) > 0 or heights is not None
    _complete(p0[2], p1[2], known, profile)
    return profile


def region_halfspaces(region, polygon=None) -> tuple[np.ndarray, np.ndarray]:
    """Returns normals (m, 3), offsets (m,): normals @ p + offsets >= 0 for points p (in W) above or on the region, or on the
    part ``polygon`` of it (convex, counter-clockwise, in its frame [m], (m, 2))."""
    boundary, pose = _outline(region)
    return _halfspaces(boundary if polygon is None else np.array(polygon, dtype=float), pose)


def _outline(region):
    """Boundary and pose as copies, so that compiled functions see one kind of array."""
    return np.array(region.boundary, dtype=float), np.array(region.X_WR, dtype=float)


@njit(cache=True)
def _halfspaces(boundary, pose):
    corners = len(boundary)
    normals, offsets, size = np.empty((corners, 3)), np.empty(corners), 0
    for k in range(corners):
        x, y = boundary[k, 0], boundary[k, 1]
        along, across = boundary[(k + 1) % corners, 0] - x, boundary[(k + 1) % corners, 1] - y
        length = np.sqrt(along * along + across * across)
        if length <= 1e-9:
            continue
        inward_x, inward_y = -across / length, along / length  # left of a counter-clockwise edge
        offset = -(inward_x * x + inward_y * y)
        for i in range(3):
            normals[size, i] = inward_x * pose[i, 0] + inward_y * pose[i, 1]
            offset -= normals[size, i] * pose[i, 3]
        offsets[size] = offset
        size += 1
    return normals[:size], offsets[:size]


@njit(cache=True)
def _raise_over(boundary, pose, foot_radius, p0, p1, profile, is_known):
    """Raises the profile to the height of a foot centre on the region's plane, where the way leads over the region and
    the ground is not known better."""
    normals, offsets = _halfspaces(boundary, pose)
    for k in range(len(profile)):
        if is_known[k]:
            continue
        x, y = p0[0] + PARTS[k] * (p1[0] - p0[0]), p0[1] + PARTS[k] * (p1[1] - p0[1])
        drop = (x - pose[0, 3]) * pose[0, 2] + (y - pose[1, 3]) * pose[1, 2]
        height = pose[2, 3] + (foot_radius - drop) / pose[2, 2]
        inside = True
        for i in range(len(offsets)):
            distance = normals[i, 0] * x + normals[i, 1] * y + normals[i, 2] * height + offsets[i]
            inside = inside and distance >= -foot_radius
        if inside:
            profile[k] = max(profile[k], height)


@njit(cache=True)
def _take_heights(corner, cell, heights, foot_radius, p0, p1, profile, is_known):
    """Writes the height of a foot centre on the map into the profile, and where the way leads over known ground."""
    radius = foot_radius + _ASIDE
    reach = int(np.ceil(radius / cell))
    for k in range(len(profile)):
        x, y = p0[0] + PARTS[k] * (p1[0] - p0[0]), p0[1] + PARTS[k] * (p1[1] - p0[1])
        i0, j0 = int(np.floor((x - corner[0]) / cell)), int(np.floor((y - corner[1]) / cell))
        highest = -np.inf
        for i in range(max(i0 - reach, 0), min(i0 + reach + 1, heights.shape[0])):
            for j in range(max(j0 - reach, 0), min(j0 + reach + 1, heights.shape[1])):
                # From the nearest point of the cell, whatever is highest in it may be there.
                dx = max(abs(corner[0] + (i + 0.5) * cell - x) - 0.5 * cell, 0.0)
                dy = max(abs(corner[1] + (j + 0.5) * cell - y) - 0.5 * cell, 0.0)
                squared = radius * radius - dx * dx - dy * dy
                if squared > 0.0 and np.isfinite(heights[i, j]):
                    highest = max(highest, heights[i, j] + np.sqrt(squared) - _ASIDE)
        inside = 0 <= i0 < heights.shape[0] and 0 <= j0 < heights.shape[1]
        profile[k] = highest
        is_known[k] = inside and np.isfinite(heights[i0, j0])


@njit(cache=True)
def _complete(start, end, is_known, profile):
    """Fills in what may be expected where nothing is known (-inf)."""
    for k in range(len(profile)):
        if np.isfinite(profile[k]):
            continue
        if abs(end - start) < _STEP:
            profile[k] = start + PARTS[k] * (end - start)
            continue
        from_lower = PARTS[k] if end > start else 1.0 - PARTS[k]
        profile[k] = min(start, end) if from_lower < _LATEST_EDGE else max(start, end)
    if is_known:  # the foot does stand at both ends, whatever the regions' planes say
        profile[0], profile[-1] = start, end
