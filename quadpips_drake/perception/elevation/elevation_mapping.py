"""An elevation map from depth images: robot-centred, one fused height per cell.

After P. Fankhauser et al., "Probabilistic Terrain Mapping for Mobile Robots with Uncertain Localization" (RA-L 2018), as the
baselines of QuadPiPS use it: each cell is a one-dimensional Kalman filter behind a Mahalanobis gate, and a visibility check
removes what the camera sees through. The window is fixed to the world and travels with the base in whole cells, so that
nothing is resampled.

Two things are stricter here, in the map's favour: an image's points in one cell are first reduced to one height, that of
the highest surface among them, and a point that the same image sees through on all sides makes no new surface.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.perception.assumed_ground import assumed_plane
from quadpips_drake.perception.egocan.view_kernels import pack_camera
from quadpips_drake.perception.elevation import elevation_kernels as kernels
from quadpips_drake.perception.elevation.elevation_config import ElevationMapConfig
from quadpips_drake.perception.scrolling import shifted
from quadpips_drake.values.regions import ElevationMap
from quadpips_drake.values.sensing import CameraIntrinsics


@dataclass(frozen=True, eq=False)
class DepthView:
    """One depth image and where it was taken."""

    X_WC: np.ndarray
    """Pose of the optical frame C in the world, (4, 4)."""
    intrinsics: CameraIntrinsics
    depth: np.ndarray
    """[m], float32 (height, width); +inf: nothing in range; NaN and 0: not measured. Without pixels: no image."""


def begin_map(
    stamp: float, views: Sequence[DepthView], X_WB: np.ndarray, p_WG: np.ndarray, config: ElevationMapConfig
) -> ElevationMap:
    """Returns the map at the start: the first images, and the assumption that the robot stands on flat ground.

    Args:
        stamp, views, X_WB, config: as for ``update_map``.
        p_WG: ground points under the feet [m], (4, 3); see ``assumed_plane``.
    """
    fresh = ElevationMap.empty(config.cells, config.cell)
    if not usable(stamp, views, X_WB):
        return fresh
    fresh = _scrolled(fresh, X_WB, config)
    n, cell, height, variance = len(fresh.height), config.cell, np.array(fresh.height), np.array(fresh.variance)
    x = (fresh.first_cell[0] + np.arange(n) + 0.5)[:, None] * cell
    y = (fresh.first_cell[1] + np.arange(n) + 0.5)[None, :] * cell
    z, _, chosen = assumed_plane(x, y, [(view.X_WC, view.intrinsics) for view in views], X_WB, p_WG, config)
    # Doubtful enough that a measurement nearby takes its place, and not so much that any outlier does.
    height[chosen], variance[chosen] = z[chosen], max(config.min_variance, config.multi_height_variance)
    assumed = replace(fresh, height=height, variance=variance, X_WB=X_WB)
    return update_map(assumed, stamp, views, X_WB, config)


def update_map(
    before: ElevationMap, stamp: float, views: Sequence[DepthView], X_WB: np.ndarray, config: ElevationMapConfig
) -> ElevationMap:
    """Returns the map ``before``, moved to the base and fused with what ``views`` show.

    Args:
        before: the map.
        stamp: time of the images [s]. Unless they are newer than the map, nothing changes.
        views: of all cameras. Those without pixels are skipped.
        X_WB: pose of the base at that time, (4, 4).
        config: of the map, without null.
    """
    if not usable(stamp, views, X_WB) or not stamp > before.stamp:
        return before
    if _jumped(before, X_WB, config):
        before = ElevationMap.empty(config.cells, config.cell)
    scrolled = _scrolled(before, X_WB, config)
    cleans = stamp - before.cleaned > config.clean_up_period - 1e-6
    height, variance = np.array(scrolled.height), np.array(scrolled.variance)
    window = scrolled.first_cell, config.cell
    sigmas = (config.depth_sigma, config.depth_sigma_growth)
    rule = (config.min_variance, config.max_variance, config.gate, config.multi_height_variance, config.see_through)
    for view in views:
        if view.depth.size == 0:
            continue
        camera, total = pack_camera(view.X_WC, view.intrinsics), np.zeros((*height.shape, 3), np.float32)
        kernels.collect_heights(view.depth, camera, *window, (config.nearest, config.farthest), sigmas, config.layer, total)
        kernels.fuse_heights(total, view.depth, camera, *window, rule, cleans, height, variance)
    cleaned = stamp if cleans else before.cleaned
    return ElevationMap(stamp, scrolled.first_cell, config.cell, height, variance, X_WB, cleaned)


def usable(stamp: float, views: Sequence[DepthView], X_WB: np.ndarray) -> bool:
    """Whether time and pose are known and any camera shows anything."""
    known = np.isfinite(stamp) and np.isfinite(X_WB).all() and all(np.isfinite(view.X_WC).all() for view in views)
    return bool(known and any(view.depth.size > 0 for view in views))


def _scrolled(before: ElevationMap, X_WB: np.ndarray, config: ElevationMapConfig) -> ElevationMap:
    """Returns the window around the base with the cells that it shares with ``before``."""
    first_cell = np.floor(X_WB[:2, 3] / config.cell).astype(np.int64) - config.cells // 2
    by = (first_cell - before.first_cell).tolist()
    return replace(before, first_cell=first_cell, height=shifted(before.height, *by), variance=shifted(before.variance, *by))


def _jumped(before: ElevationMap, X_WB: np.ndarray, config: ElevationMapConfig) -> bool:
    """Whether the pose estimate jumped, so that old heights no longer fit."""
    if not np.isfinite(before.stamp):
        return False
    moved = np.linalg.norm(X_WB[:3, 3] - before.X_WB[:3, 3])
    old, new = before.X_WB[:2, 0], X_WB[:2, 0]
    turned = abs(np.arctan2(old[0] * new[1] - old[1] * new[0], old @ new))
    return bool(moved > config.max_jump or turned > config.max_turn)
