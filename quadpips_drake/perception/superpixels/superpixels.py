"""Over-segmentation of the egocan's floor cap into planar superpixels (QuadPiPS section V-D, equations 10-14)."""

from dataclasses import replace

import numpy as np

from quadpips_drake.configuration.schema import MAX_SEED, configuration, ranged
from quadpips_drake.framework.stage_config import OnDemandStageConfig, stage_rate
from quadpips_drake.perception.superpixels import superpixel_kernels as kernels
from quadpips_drake.perception.superpixels.superpixel_health import check_health
from quadpips_drake.perception.superpixels.superpixel_tracking import (
    can_follow,
    clusters_in_world,
    keep_ids,
    propagate_clusters,
)
from quadpips_drake.values.images import EgocanImage, SuperpixelImage
from quadpips_drake.values.steppability import Steppability

_ALLOWED = np.isin(np.arange(256), (Steppability.UNKNOWN, Steppability.STEPPABLE))
"""Labels on which a foot may stand; UNKNOWN does not forbid: without labels, ground is judged by its geometry."""
_EVERY = np.isin(np.arange(256), tuple(Steppability))
"""Labels when planning weighs them itself."""


@configuration
class SuperpixelConfig(OnDemandStageConfig):
    """Parameters of the health check and of the clustering."""

    rate: float = stage_rate(20.0, on_demand=True)
    """How often the cap is segmented [Hz] (QuadPiPS: 20); 0: whenever it is read, each image by itself."""
    num_superpixels: int = ranged(175, 1, 2000)
    """Clusters wanted on a full cap, k_des; sets the grid step s = sqrt(pixels / k_des) [pixels]."""
    iterations: int = ranged(5, 1, 100)
    """Rounds of assignment and update."""
    warm_iterations: int = ranged(2, 0, 100)
    """Rounds when the clusters of the last frame are there to begin with; 0 begins afresh with every frame."""
    max_jump: float = ranged(0.5, 0.001, 100.0)
    """The last frame is forgotten when the camera moves further than this between two frames [m]."""
    max_turn: float = ranged(0.7, 0.001, 4.0)
    """The last frame is forgotten when the base yaws further than this between two frames [rad]."""
    weight_normal: float = ranged(25.0, 0.0, 1e6)
    """w_n of equation 10, for 1 - n_c . n with a scale of 2."""
    weight_plane: float = ranged(100.0, 0.0, 1e6)
    """w_p of equation 10 [1/m], for the distance to the cluster's plane."""
    weight_world: float = ranged(25.0, 0.0, 1e6)
    """w_w of equation 10 [1/m], for the distance to the cluster's centre."""
    weight_compact: float = ranged(0.0, 0.0, 1e6)
    """w_c of equation 10, for the distance in the image with a scale of sqrt(2) s."""
    min_upward: float = ranged(0.86, 0.01, 1.0)
    """Least component of a healthy pixel's normal against gravity; 0.86 is a slope of 30.7 deg."""
    max_depth: float = ranged(1.2, 0.01, 10.0)
    """Greatest height of the camera above a healthy pixel [m]."""
    max_step: float = ranged(0.015, 0.001, 1.0)
    """Neighbouring pixels that are further apart than this along the normal are not connected [m]."""
    min_pixels: int = ranged(16, 3, 10_000)
    """Smallest superpixel [pixels]."""
    ransac_iterations: int = ranged(25, 0, 1000)
    """Planes tried for each cluster; 0 takes the mean normal."""
    ransac_samples: int = ranged(10, 3, 100)
    """Points for each plane tried."""
    ransac_threshold: float = ranged(0.01, 1e-4, 1.0)
    """Greatest distance of an inlier from the plane [m]."""
    seed: int = ranged(1, 0, MAX_SEED)
    """Of the random choice of samples."""


def cap_points(can: EgocanImage) -> np.ndarray:
    """Returns the point of each pixel of the cap in E [m], float32 (h_cap, w_cap, 3); NaN where unknown."""
    return _check_health(can, SuperpixelConfig())[0]


def healthy_pixels(can: EgocanImage, config: SuperpixelConfig) -> np.ndarray:
    """Returns the pixels of the cap that may carry a foot, bool (h_cap, w_cap) (QuadPiPS section V-D.1).

    Healthy is what has a depth in range, an upward normal and no label that forbids stepping (UNKNOWN does not forbid), and
    what is not alone: noise makes some points of a wall look like floor.
    """
    return _check_health(can, config)[1]


def _check_health(can: EgocanImage, config: SuperpixelConfig, every_label=False) -> tuple[np.ndarray, np.ndarray]:
    return check_health(
        can.cap_height,
        can.cap_normals,
        can.cap_labels,
        _EVERY if every_label else _ALLOWED,
        can.cap_rays,
        config.max_depth,
        config.min_upward,
        config.max_step,
    )


def _is_well_formed(can: EgocanImage) -> bool:
    """Whether the images of the cap are not empty and fit together."""
    shape = can.cap_height.shape
    fits = can.cap_normals.shape == (*shape, 3) and can.cap_labels.shape == shape
    return len(shape) == 2 and can.cap_height.size > 0 and fits and bool(np.isfinite(can.X_WE).all())


def segment_superpixels(
    can: EgocanImage, config: SuperpixelConfig, previous: SuperpixelImage | None = None, every_label: bool = False
) -> SuperpixelImage:
    """Returns connected planar superpixels of the floor cap.

    SLIC with the distance of equation 10 on the healthy pixels: seeds on a grid, moved to the centroid of the healthy
    pixels around them; each cluster claims pixels within +-s; centroid and (by RANSAC) normal are updated. Beyond the
    paper, a cluster is then split where a gap or a step parts it, so that no superpixel spans two surfaces.

    ``previous``: the superpixels of the frame before. Its clusters, moved by the base's motion, are the seeds then, with new
    ones only where the ground is new, and fewer rounds are needed; superpixels keep the ids of the ground they lie on. A
    jump of the pose, or time that runs backwards, starts afresh.

    ``every_label``: whether pixels of every label are healthy, not only those that are steppable or unknown.
    """
    if not _is_well_formed(can):
        return SuperpixelImage.empty() if previous is None else replace(SuperpixelImage.empty(), next_id=previous.next_id)
    points, healthy = _check_health(can, config, every_label)
    normals = can.cap_normals
    planes, active = kernels.healthy_planes(points, normals, healthy)
    step = max(2, int(np.sqrt(healthy.size / config.num_superpixels)))
    weights = (
        config.weight_normal / 2.0,
        config.weight_plane,
        config.weight_world,
        config.weight_compact / (np.sqrt(2) * step),
    )
    ransac = (config.ransac_iterations, config.ransac_samples, config.ransac_threshold, config.seed)
    follows = can_follow(previous, can, config.max_jump, config.max_turn)
    moved = propagate_clusters(previous, can) if follows and config.warm_iterations else np.empty((0, 9))
    clusters = kernels.seed_clusters(points, normals, healthy, step, moved, config.max_step)
    assignment, best = np.empty(healthy.shape, np.int32), np.empty(healthy.shape, np.float32)
    for _ in range(config.warm_iterations if len(moved) else config.iterations):
        kernels.assign_pixels(planes, clusters, step, weights, best, assignment)
        kernels.update_clusters(points, normals, assignment, active, clusters, ransac)
    count = kernels.split_clusters(points, normals, assignment, active, config.max_step, config.min_pixels)
    pieces = np.zeros((count, 9))
    kernels.update_clusters(points, normals, assignment, active, pieces, ransac)
    centers_W = pieces[:, 2:5] @ can.X_WE[:3, :3].T + can.X_WE[:3, 3]
    ids, homes, next_id = keep_ids(previous, follows, assignment, points, centers_W, can.X_WE, config.max_step)
    return SuperpixelImage(
        stamp=can.stamp,
        X_WE=can.X_WE,
        assignment=assignment,
        points=points,
        centers=pieces[:, 2:5],
        normals=pieces[:, 5:8],
        labels=kernels.common_labels(assignment, can.cap_labels, count),
        cap_rays=can.cap_rays,
        healthy=healthy,
        clusters=clusters_in_world(clusters, can.X_WE),
        ids=ids,
        homes=homes,
        next_id=next_id,
    )
