"""How far any place is from ground that carries a foot: a raster over the regions, seen from above."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt


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

    def look_up(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns distance and height at points (..., 2); outside of the raster the distance is inf."""
        cells = np.rint((xy - self.origin) / self.resolution).astype(np.int64)
        rows, columns = self.distance.shape
        inside = (cells[..., 0] >= 0) & (cells[..., 0] < columns) & (cells[..., 1] >= 0) & (cells[..., 1] < rows)
        ix, iy = np.where(inside, cells[..., 0], 0), np.where(inside, cells[..., 1], 0)
        return np.where(inside, self.distance[iy, ix], np.inf), self.height[iy, ix]


def make_support_map(regions, resolution: float = 0.04, border: float = 0.6) -> SupportMap:
    """Rasters the insets of ``regions`` (at least one PlanarRegion); where they overlap, the higher one counts.

    Args:
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
    return SupportMap(origin, resolution, distance * resolution, height)


def ground_penalty(support: SupportMap, poses: np.ndarray, ground: np.ndarray, robot, config) -> np.ndarray:
    """Returns the extra cost per metre of poses of the base over poor ground, (...); inf where a leg finds none.

    It is ``support_weight`` times the mean distance of the nominal footholds from steppable ground, as far as it exceeds
    ``free_miss``, over ``leg_radius``.

    Args:
        poses: x, y, yaw of the base in W, (..., 3).
        ground: height of the ground under the base [m], (...).
        config: TorsoConfig.
    """
    nominal = np.asarray(robot.nominal_footholds_B)[:, :2]
    c, s = np.cos(poses[..., 2, None]), np.sin(poses[..., 2, None])
    x = poses[..., 0, None] + c * nominal[:, 0] - s * nominal[:, 1]
    y = poses[..., 1, None] + s * nominal[:, 0] + c * nominal[:, 1]
    distance, height = support.look_up(np.stack([x, y], axis=-1))
    within = (distance <= config.leg_radius) & (np.abs(height - ground[..., None]) <= config.max_height_difference)
    miss = np.where(within, distance, np.inf)
    excess = np.maximum(miss - config.free_miss, 0.0)
    return config.support_weight * excess.mean(axis=-1) / config.leg_radius
