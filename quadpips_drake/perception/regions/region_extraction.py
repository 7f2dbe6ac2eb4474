"""From superpixels to planar convex regions that may carry a foot (QuadPiPS section V-E)."""

import cv2
import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.stage_config import stage_rate
from quadpips_drake.perception.regions import region_kernels as kernels
from quadpips_drake.perception.regions.region_source_config import RegionSourceConfig
from quadpips_drake.values.images import SuperpixelImage
from quadpips_drake.values.regions import PlanarRegion, RegionSet


@configuration
class RegionConfig(RegionSourceConfig):
    """Parameters of the region extraction."""

    rate: float = stage_rate(0.0, on_demand=True)
    """How often regions are extracted [Hz]; 0: whenever they are read (the superpixels set the rate)."""
    overlap: float = ranged(0.03, 0.0, 0.2)
    """Insets reach this far beyond their superpixel where there is ground, so that no gaps remain between them [m]."""
    max_off_plane: float = ranged(0.02, 0.001, 1.0)
    """A pixel further than this from a region's plane is not ground of that region [m]."""
    max_speck: int = ranged(2, 0, 10)
    """Holes in the ground that are up to this wide are noise or cracks of the drawing, which no foot falls into [pixels]."""
    max_vertices: int = ranged(10, 3, 32)
    """Most vertices of an inset polygon."""


def extract_regions(superpixels: SuperpixelImage, foot_radius: float, config: RegionConfig) -> RegionSet:
    """Returns the convex regions of ``superpixels``, in W. ``foot_radius`` in [m].

    Where the paper takes the hull of a superpixel as it is, hulls here hold nothing but seen ground: the hull of the pixels
    is grown by foot radius + margin + overlap, then cut back (by half planes, nearest offender first) until no pixel is left
    in it that is unknown, not healthy or off the plane. That is the boundary; shrunk by foot radius + margin it becomes the
    inset. So the inset of a superpixel in the middle of a floor is the superpixel itself and ``config.overlap`` around it,
    while at an edge of the floor the inset keeps its distance.
    """
    if len(superpixels.centers) == 0:
        return RegionSet(stamp=superpixels.stamp)
    clearance = foot_radius + config.margin
    found = kernels.carve_regions(
        superpixels.assignment,
        superpixels.points,
        _fill_specks(superpixels.healthy, config.max_speck),
        superpixels.centers,
        superpixels.normals,
        superpixels.cap_rays,
        clearance,
        config.overlap,
        config.min_radius,
        config.max_off_plane,
        config.max_vertices,
        np.ascontiguousarray(superpixels.X_WE[:3, :3].T @ np.array([1.0, 0.0, 0.0])),
    )
    frames, boundaries, boundary_sizes, insets, inset_sizes, clusters = found
    X_WR = superpixels.X_WE @ frames
    for array in (X_WR, boundaries, insets):  # at once, instead of each region's part by itself
        array.flags.writeable = False
    ids, labels = superpixels.ids[clusters].tolist(), superpixels.labels[clusters].tolist()
    regions = [
        PlanarRegion(ids[k], X_WR[k], boundaries[k, :boundary_size], insets[k, :inset_size], labels[k])
        for k, (boundary_size, inset_size) in enumerate(zip(boundary_sizes.tolist(), inset_sizes.tolist(), strict=True))
    ]
    return RegionSet(stamp=superpixels.stamp, regions=tuple(regions))


def _fill_specks(healthy: np.ndarray, width: int) -> np.ndarray:
    """Returns ``healthy``, bool (h, w), without holes that are at most ``width`` pixels wide (morphological closing)."""
    if width == 0:
        return healthy
    square = np.ones((width + 1, width + 1), np.uint8)
    return cv2.morphologyEx(healthy.view(np.uint8), cv2.MORPH_CLOSE, square).view(np.bool_)
