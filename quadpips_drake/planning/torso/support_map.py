"""How far any place is from ground that carries a foot: a raster over the regions, seen from above."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numba import njit
from scipy.ndimage import distance_transform_edt

from quadpips_drake.planning.torso.torso_room import HighGround, leave_out_without_room, torso_of
from quadpips_drake.robots.stance_limits import stance_limits
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.regions import GroundHeights

_SAMPLE = 0.06
"""Distance between the places where a leg looks for ground [m]."""
_ON_GROUND = 0.045
"""Such a place has ground when some is this near to it [m]: half the diagonal of what lies between them."""


@dataclass(frozen=True)
class SupportMap:
    """Distance to, and height of, the nearest steppable ground on a grid; frame W."""

    origin: np.ndarray
    """xy of the centre of cell (0, 0) [m], (2,)."""
    resolution: float
    """[m]"""
    distance: np.ndarray
    """Distance in xy to the nearest inset polygon [m], indexed [iy, ix]."""
    height: np.ndarray
    """Height of that polygon at its nearest cell [m], indexed [iy, ix]."""
    nearest: np.ndarray
    """That cell, [0 for iy, 1 for ix][iy, ix]."""
    high: HighGround | None = None
    """What the torso must not hit; None: nothing is known of it."""

    def look_up(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns distance and height at points (..., 2); outside of the raster the distance is inf."""
        ix, iy, inside = self.cells(xy)
        return np.where(inside, self.distance[iy, ix], np.inf), self.height[iy, ix]

    def cells(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the columns and rows of points (..., 2), and whether they are in the raster (if not: cell 0, 0)."""
        cells = np.rint((xy - self.origin) / self.resolution).astype(np.int64)
        rows, columns = self.distance.shape
        inside = (cells[..., 0] >= 0) & (cells[..., 0] < columns) & (cells[..., 1] >= 0) & (cells[..., 1] < rows)
        return np.where(inside, cells[..., 0], 0), np.where(inside, cells[..., 1], 0), inside

    def highest_near(self, xy: np.ndarray, radius: float) -> float:
        """How high the highest known surface within ``radius`` [m] of ``xy`` (2,) is above the ground there [m]."""
        steps = np.arange(-radius, radius + self.resolution, self.resolution)
        return self._highest(xy + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2))

    def highest_between(self, start: np.ndarray, end: np.ndarray) -> float:
        """The same on the straight way from ``start`` to ``end``, (2,) each."""
        count = int(np.hypot(*(end - start)) / (0.5 * self.resolution)) + 1
        return self._highest(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start))

    def _highest(self, places: np.ndarray) -> float:
        ix, iy, inside = self.cells(places)
        if self.high is None or not inside.any():
            return 0.0
        ix, iy = ix[inside], iy[inside]
        return float((self.high.top[iy, ix] - self.height[iy, ix]).max())


def make_support_map(
    regions, resolution: float = 0.04, border: float = 0.6, heights: GroundHeights | None = None
) -> SupportMap:
    """Rasters the insets of ``regions`` (at least one PlanarRegion); where they overlap, the higher one counts.

    Args:
        heights: of all surfaces, those included that carry no foot.
        resolution: size of a cell [m].
        border: how far the raster extends beyond the regions [m].
    """
    outlines = [region.inset @ region.X_WR[:3, :2].T + region.center for region in regions]
    corners = np.concatenate(outlines)[:, :2]
    origin = corners.min(axis=0) - border
    columns, rows = (np.ceil((corners.max(axis=0) + border - origin) / resolution)).astype(int) + 1
    owner = np.full((rows, columns), -1.0, dtype=np.float32)
    for k in np.argsort([outline[:, 2].max() for outline in outlines], kind="stable"):
        cells = np.rint((outlines[k][:, :2] - origin) / resolution).astype(np.int32)
        cv2.fillConvexPoly(owner, cells, float(k))
    distance, nearest = distance_transform_edt(owner < 0.0, return_indices=True)
    index = owner[nearest[0], nearest[1]].astype(np.int64)

    centers = np.array([region.center for region in regions])[index]
    normals = np.array([region.normal for region in regions])[index]
    x = origin[0] + resolution * nearest[1] - centers[..., 0]
    y = origin[1] + resolution * nearest[0] - centers[..., 1]
    height = centers[..., 2] - (normals[..., 0] * x + normals[..., 1] * y) / normals[..., 2]
    high = None if heights is None else HighGround.over(heights, origin, resolution, distance.shape)
    return SupportMap(origin, resolution, distance * resolution, height, nearest, high)


@lru_cache(maxsize=32)
def places_of_legs(robot, leg_radius: float) -> np.ndarray:
    """Returns where each leg may find ground, in the frame of the base's yaw, the nearest to its nominal foothold first.

    Forward and backward up to ``leg_radius``; inward and outward half of what the robot's stance limits leave.

    Returns:
        x, y [m] and the distance from the nominal foothold [m], (4, m, 3).
    """
    nominal, limits = np.asarray(robot.nominal_footholds_B)[:, :2], stance_limits(robot)
    along = np.linspace(-1.0, 1.0, 2 * int(np.ceil(leg_radius / _SAMPLE)) + 1) * leg_radius
    rows = []
    for leg in Leg:
        width = abs(nominal[leg, 1] - nominal[leg ^ 1, 1])
        inward, outward = 0.5 * (width - limits.min_width), 0.5 * (limits.max_width - width)
        inner = np.linspace(-inward, 0.0, int(np.ceil(inward / _SAMPLE)) + 1)
        outer = np.linspace(0.0, outward, int(np.ceil(outward / _SAMPLE)) + 1)
        aside = np.concatenate([inner, outer[1:]])
        dx, dy = (grid.ravel() for grid in np.meshgrid(along, aside, indexing="ij"))
        away = np.hypot(dx, dy)
        order = np.argsort(away, kind="stable")
        places = np.column_stack([nominal[leg, 0] + dx, nominal[leg, 1] + leg.side * dy, away])
        rows.append(places[order])
    shortest = min(len(row) for row in rows)
    found = np.array([row[:shortest] for row in rows])
    found.flags.writeable = False
    return found


@njit(cache=True, nogil=True)
def mean_miss(distance, height, origin, resolution, x0, y0, yaw, ground, places, max_height_difference, free_miss):
    """How far on average the legs of one pose are from ground at their nominal footholds, inf: one finds none.

    Args:
        distance, height, origin, resolution: of a SupportMap.
        x0, y0, yaw, ground: the base in W, and the height of the ground below it.
        places: from ``places_of_legs``.
    """
    rows, columns = distance.shape
    c, s = np.cos(yaw), np.sin(yaw)
    total = 0.0
    for leg in range(places.shape[0]):
        found, without = np.inf, 0.0
        for k in range(places.shape[1]):
            away = places[leg, k, 2]
            if away < without:  # the nearest ground is further away than this place
                continue
            x = x0 + c * places[leg, k, 0] - s * places[leg, k, 1]
            y = y0 + s * places[leg, k, 0] + c * places[leg, k, 1]
            ix, iy = int(np.rint((x - origin[0]) / resolution)), int(np.rint((y - origin[1]) / resolution))
            if ix < 0 or iy < 0 or ix >= columns or iy >= rows:
                continue
            miss = distance[iy, ix]
            if k == 0:
                without = miss - _ON_GROUND
            if miss <= _ON_GROUND and abs(height[iy, ix] - ground) <= max_height_difference:
                found = away + miss
                break
        total += max(found - free_miss, 0.0)
        if total == np.inf:
            break
    return total / places.shape[0]


@njit(cache=True, nogil=True)
def _mean_misses(distance, height, origin, resolution, poses, ground, places, max_height_difference, free_miss, out):
    """Fills ``out`` (n,) with ``mean_miss`` of ``poses`` (n, 3)."""
    for n in range(len(poses)):
        out[n] = mean_miss(
            distance, height, origin, resolution, poses[n, 0], poses[n, 1], poses[n, 2], ground[n], places,
            max_height_difference, free_miss,
        )  # fmt: skip


def ground_penalty(support: SupportMap, poses: np.ndarray, ground: np.ndarray, robot, config) -> np.ndarray:
    """Returns the extra cost per metre of poses of the base over poor ground, (...); inf where a leg finds none, and where
    something reaches up to the torso (nearer than ``belly_clearance``).

    It is ``support_weight`` times how far the legs must go from their nominal footholds to find steppable ground, on average
    and as far as it exceeds ``free_miss``, over ``leg_radius``.

    Args:
        poses: x, y, yaw of the base in W, (..., 3).
        ground: height of the ground under the base [m], (...).
        config: TorsoConfig.
    """
    places = places_of_legs(robot, float(config.leg_radius))
    flat, below = np.ascontiguousarray(poses, dtype=float).reshape(-1, 3), np.ascontiguousarray(ground, dtype=float).ravel()
    misses = np.empty(len(flat))
    _mean_misses(
        support.distance, support.height, support.origin, support.resolution, flat, below, places,
        config.max_height_difference, config.free_miss, misses,
    )  # fmt: skip
    if support.high is not None:
        torso = torso_of(robot, float(config.body_margin))
        leave_out_without_room(
            support.high.top, support.high.around, support.height, support.origin, support.resolution, flat, below,
            torso.points, torso.fore, torso.hind, torso.belly - config.belly_clearance, misses,
        )  # fmt: skip
    return (config.support_weight * misses / config.leg_radius).reshape(np.shape(poses)[:-1])
