"""Over-segmentation of the egocan's floor cap into planar superpixels (QuadPiPS section V-D, equations 10-14)."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception import superpixel_kernels as kernels
from quadpips_drake.perception.images import EgocanImage, SuperpixelImage
from quadpips_drake.terrain.steppability import Steppability


@dataclass
class SuperpixelConfig:
    """Parameters of the health check and of the clustering."""

    num_superpixels: int = 175
    """Clusters wanted on a full cap, k_des; sets the grid step s = sqrt(pixels / k_des) [pixels]."""
    iterations: int = 5
    """Rounds of assignment and update."""
    weight_normal: float = 25.0
    """w_n of equation 10, for 1 - n_c . n with a scale of 2."""
    weight_plane: float = 100.0
    """w_p of equation 10 [1/m], for the distance to the cluster's plane."""
    weight_world: float = 25.0
    """w_w of equation 10 [1/m], for the distance to the cluster's centre."""
    weight_compact: float = 0.0
    """w_c of equation 10, for the distance in the image with a scale of sqrt(2) s."""
    min_upward: float = 0.86
    """Least component of a healthy pixel's normal against gravity; 0.86 is a slope of 30.7 deg."""
    max_depth: float = 1.2
    """Greatest height of the camera above a healthy pixel [m]."""
    max_step: float = 0.015
    """Neighbouring pixels that are further apart than this along the normal are not connected [m]."""
    min_pixels: int = 16
    """Smallest superpixel [pixels]."""
    ransac_iterations: int = 25
    """Planes tried for each cluster; 0 takes the mean normal."""
    ransac_samples: int = 10
    """Points for each plane tried."""
    ransac_threshold: float = 0.01
    """Greatest distance of an inlier from the plane [m]."""
    seed: int = 1
    """Of the random choice of samples."""
    period: float = 0.05
    """Time between two updates [s]; 0 computes on demand."""

    def __post_init__(self):
        if self.num_superpixels < 1 or self.iterations < 1 or self.min_pixels < 3:
            raise UserInputError("superpixels: need num_superpixels >= 1, iterations >= 1 and min_pixels >= 3")
        if not 0 < self.min_upward <= 1:
            raise UserInputError(f"superpixels: min_upward must be within (0, 1], got {self.min_upward}")
        if min(self.max_depth, self.max_step, self.ransac_threshold) <= 0 or self.period < 0:
            raise UserInputError("superpixels: max_depth, max_step, ransac_threshold must be positive, period not negative")
        if self.ransac_iterations < 0 or self.ransac_samples < 3:
            raise UserInputError("superpixels: need ransac_iterations >= 0 and ransac_samples >= 3")


def cap_points(can: EgocanImage) -> np.ndarray:
    """Returns the point of each pixel of the cap in E [m], float32 (h_cap, w_cap, 3); NaN where unknown."""
    rows, columns = can.cap_height.shape
    base, growth = can.cap_rays.astype(np.float32)
    pixel = base + growth * can.cap_height
    points = np.empty((rows, columns, 3), np.float32)
    points[..., 0] = pixel * (np.arange(columns, dtype=np.float32) - columns // 2)
    points[..., 1] = can.cap_height
    points[..., 2] = pixel * (np.arange(rows, dtype=np.float32) - rows // 2)[:, None]
    return points


def healthy_pixels(can: EgocanImage, config: SuperpixelConfig) -> np.ndarray:
    """Returns the pixels of the cap that may carry a foot, bool (h_cap, w_cap) (QuadPiPS section V-D.1).

    Healthy is what has a depth in range, an upward normal and no label that forbids stepping (UNKNOWN does not forbid), and
    what is not alone: noise makes some points of a wall look like floor.
    """
    labels = can.cap_labels
    with np.errstate(invalid="ignore"):
        healthy = (can.cap_height > 0) & (can.cap_height <= config.max_depth)
        healthy &= -can.cap_normals[..., 1] >= config.min_upward
    healthy &= (labels == Steppability.UNKNOWN) | (labels == Steppability.STEPPABLE)
    return kernels.supported_pixels(cap_points(can), can.cap_normals, healthy, config.max_step)


def segment_superpixels(can: EgocanImage, config: SuperpixelConfig) -> SuperpixelImage:
    """Returns connected planar superpixels of the floor cap.

    SLIC with the distance of equation 10 on the healthy pixels: seeds on a grid, moved to the centroid of the healthy
    pixels around them; each cluster claims pixels within +-s; centroid and (by RANSAC) normal are updated. Beyond the
    paper, a cluster is then split where a gap or a step parts it, so that no superpixel spans two surfaces.
    """
    if can.cap_height.size == 0:
        return SuperpixelImage.empty()
    points = cap_points(can)
    healthy = healthy_pixels(can, config)
    rows, columns = healthy.shape
    step = max(2, int(np.sqrt(rows * columns / config.num_superpixels)))
    weights = np.array(
        [config.weight_normal / 2.0, config.weight_plane, config.weight_world, config.weight_compact / (np.sqrt(2) * step)]
    )
    ransac = (config.ransac_iterations, config.ransac_samples, config.ransac_threshold, config.seed)
    clusters = kernels.seed_clusters(points, can.cap_normals, healthy, step)
    assignment = np.full((rows, columns), -1, np.int32)
    for _ in range(config.iterations):
        kernels.assign_pixels(points, can.cap_normals, healthy, clusters, step, weights, assignment)
        kernels.update_clusters(points, can.cap_normals, assignment, clusters, ransac)
    count = kernels.split_clusters(points, can.cap_normals, assignment, config.max_step, config.min_pixels)
    clusters = np.zeros((count, 8))
    kernels.update_clusters(points, can.cap_normals, assignment, clusters, ransac)
    return SuperpixelImage(
        stamp=can.stamp,
        X_WE=can.X_WE,
        assignment=assignment,
        points=points,
        centers=clusters[:, 2:5],
        normals=clusters[:, 5:8],
        labels=kernels.common_labels(assignment, can.cap_labels, count),
        cap_rays=can.cap_rays,
        healthy=healthy,
    )
