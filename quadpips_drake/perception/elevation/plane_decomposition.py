"""From an elevation map to planar convex regions: as perceptive model-predictive control takes it.

After R. Grandia, F. Jenelten, S. Yang, F. Farshidian, M. Hutter, "Perceptive Locomotion through Nonlinear Model-Predictive
Control" (T-RO 2023), section III, as the baselines of QuadPiPS use it: holes are filled with the lowest height of their
border, a median removes single cells, each cell is planar or not by the plane through 3 x 3 cells, connected planar cells
are one plane, or several by RANSAC; contours are drawn with several pixels a cell.

What differs: insets keep foot radius + margin from the edges of what was seen, as those of all region sources (there, one
or two thirds of a cell), and are cut into convex pieces that are there before any foothold is chosen (there, a polygon is
grown around each foothold).
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy.spatial import cKDTree

from quadpips_drake.perception.elevation import piece_kernels, plane_kernels
from quadpips_drake.perception.elevation.elevation_config import PlaneConfig
from quadpips_drake.perception.elevation.hole_kernels import lowest_borders
from quadpips_drake.perception.superpixels.superpixel_kernels import group_pixels
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.regions import ElevationMap, PlanarRegion, RegionSet

_MAX_VERTICES = 10
"""Most vertices of an inset."""
_SAME_PLACE = 0.05
"""A region whose centre is this near to that of an earlier one is the same piece of ground [m]."""


@dataclass(frozen=True, eq=False)
class PlaneRegions(ImmutableValue):
    """The regions of one map, and what they hand on to those of the next one."""

    regions: RegionSet = field(default_factory=RegionSet.empty)
    next_id: int = 0
    """The least id that has never been given."""


@dataclass(frozen=True, eq=False)
class _Layers:
    """What the filters make of a map, all (n, n)."""

    corner: np.ndarray
    pitch: float
    height: np.ndarray
    """Filled and filtered, float32 [m]."""
    ground: np.ndarray
    """What was seen, and small holes in it, bool."""
    slopes: np.ndarray
    """dz/dx, dz/dy of the plane through 3 x 3 cells, (n, n, 2)."""
    planar: np.ndarray
    """Whether that plane fits and is not too steep, bool; only ground."""


def decompose_planes(
    elevation: ElevationMap, foot_radius: float, config: PlaneConfig, previous: PlaneRegions | None = None
) -> PlaneRegions:
    """Returns the convex regions of ``elevation``, in W.

    Args:
        elevation: the map.
        foot_radius: [m].
        config: without null.
        previous: what the last map gave; its regions hand their ids on.
    """
    previous = previous or PlaneRegions()
    found: list[PlanarRegion] = []
    layers = filter_map(elevation, config)
    if layers is not None:
        owner, planes = find_planes(layers, config)
        for index, plane in enumerate(planes):
            found += _regions_on(layers, owner == index, plane, foot_radius + config.margin, config)
    return _with_ids(elevation.stamp, found, previous)


def filter_map(elevation: ElevationMap, config: PlaneConfig) -> _Layers | None:
    """Returns the filtered layers of the map; None if nothing is known."""
    known = np.isfinite(elevation.height)
    if not known.any():
        return None
    height, ground = without_holes(elevation.height, known, elevation.cell, config.max_filled)
    pitch = elevation.cell
    if config.resample > 0:
        pitch = config.resample
        cells = max(3, round(len(height) * elevation.cell / pitch))
        height = cv2.resize(height, (cells, cells), interpolation=cv2.INTER_LINEAR)
        ground = cv2.resize(ground.view(np.uint8), (cells, cells), interpolation=cv2.INTER_NEAREST).view(bool)
    height = cv2.medianBlur(height, 3)
    slopes, roughness = _local_planes(height, pitch)
    steep = np.hypot(slopes[..., 0], slopes[..., 1]) > np.tan(config.max_steepness)
    planar = ground & ~steep & (roughness <= config.max_roughness)
    return _Layers(elevation.corner, pitch, height, ground, slopes, planar)


def without_holes(height: np.ndarray, known: np.ndarray, cell: float, widest: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the heights with all holes filled, float32, and what counts as ground, bool: known, or a hole not too wide."""
    holes = (~known).astype(np.uint8)
    count, labels = cv2.connectedComponents(holes, connectivity=8)
    lowest = lowest_borders(height, labels, count)
    filled = np.where(known, height, lowest[labels]).astype(np.float32)
    width = min(round(widest / cell), len(height))
    if width == 0:
        return filled, known.copy()
    square, anchor = np.ones((width + 1, width + 1), np.uint8), (width + 1) // 2
    grown = cv2.dilate(known.astype(np.uint8), square, anchor=(anchor, anchor))
    # Erosion by the mirrored square: OpenCV's own closing moves the mask if the side is even.
    return filled, cv2.erode(grown, square, anchor=(width - anchor, width - anchor)).astype(bool)


def _local_planes(height: np.ndarray, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the slopes (n, n, 2) [1] of the planes through 3 x 3 cells, and the root mean squares off them [m]."""
    z = height.astype(float) - float(np.median(height))
    ramp, border = np.array([-1.0, 0.0, 1.0]) / 6.0, cv2.BORDER_REPLICATE
    flat = np.ones(3)
    by_row = cv2.sepFilter2D(z, -1, flat, ramp, borderType=border)  # [m] a cell; rows run along x of W
    by_column = cv2.sepFilter2D(z, -1, ramp, flat, borderType=border)
    mean = cv2.boxFilter(z, -1, (3, 3), borderType=border)
    square = cv2.boxFilter(z * z, -1, (3, 3), borderType=border)
    variance = square - mean * mean - (by_row**2 + by_column**2) * (2.0 / 3.0)
    return np.stack([by_row, by_column], axis=-1) / pitch, np.sqrt(np.maximum(variance, 0.0))


def find_planes(layers: _Layers, config: PlaneConfig) -> tuple[np.ndarray, np.ndarray]:
    """Returns (plane of each cell, int64 (n, n), -1 where none; planes (k, 3) as (a, b, c), z = a i + b j + c in cells)."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(layers.planar.astype(np.uint8), connectivity=4)
    first, cells = group_pixels(labels - 1, count - 1, np.arange(labels.size))
    owner, planes = np.full(labels.size, -1, np.int64), []
    height, slopes, side = layers.height.ravel(), layers.slopes.reshape(-1, 2), labels.shape[1]
    rule = (config.max_off_plane, float(np.cos(config.max_off_normal)))
    steepest = np.tan(config.max_slope) * layers.pitch
    for component in range(count - 1):
        if stats[component + 1, cv2.CC_STAT_AREA] < config.min_cells:
            continue
        members = cells[first[component] : first[component + 1]]
        of_cell, found = plane_kernels.split_into_planes(
            (members // side).astype(float),
            (members % side).astype(float),
            height[members].astype(float),
            slopes[members],
            layers.pitch,
            rule,
            config.max_tries,
            config.miss,
            config.min_cells,
            config.seed + component,
        )
        for index, plane in enumerate(found):
            if np.hypot(plane[0], plane[1]) <= steepest:
                owner[members[of_cell == index]] = len(planes)
                planes.append(plane)
    return owner.reshape(labels.shape), np.array(planes).reshape(-1, 3)


def _regions_on(
    layers: _Layers, own: np.ndarray, plane: np.ndarray, clearance: float, config: PlaneConfig
) -> list[PlanarRegion]:
    """Returns the regions on one plane, without ids.

    Room for a foot's centre is what lies ``clearance`` [m] from everything that is not ground of this plane, on the cells
    that are its ``own`` or beside them.
    """
    pitch, n, pixel = layers.pitch, config.upsample, layers.pitch / config.upsample
    low, high = _window(own, int(np.ceil(clearance / pitch)) + 2)
    window = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    i, j = np.arange(low[0], high[0])[:, None], np.arange(low[1], high[1])
    off = np.abs(layers.height[window] - (plane[0] * i + plane[1] * j + plane[2]))
    on_plane = layers.ground[window] & (off <= config.max_off_plane)
    own = cv2.dilate(own[window].astype(np.uint8), np.ones((3, 3), np.uint8))
    # A rim of void, as nothing is known beyond the map.
    ground = np.pad(_upsampled(on_plane, n), 1)
    distance = (cv2.distanceTransform(ground, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1] - 0.5) * pixel
    room = (distance >= clearance) & (_upsampled(own, n) > 0)
    free = distance >= clearance - pixel
    count, _, stats, _ = cv2.connectedComponentsWithStats(room.astype(np.uint8), connectivity=8)
    corner = layers.corner + pitch * low
    first = np.rint(corner / pixel).astype(np.int64)
    # z = a x + b y + c in W instead of cells, the middle of cell 0 being at half a cell.
    slopes = plane[:2] / pitch
    in_world = np.array([*slopes, plane[2] - slopes @ (layers.corner + 0.5 * pitch)])
    regions = []
    for left, top, width, height, _ in stats[1:count].tolist():
        box = (top, top + height, left, left + width)
        piece, overlap = max(1, round(config.piece / pixel)), round(config.overlap / pixel)
        pieces = piece_kernels.convex_pieces(room, free, box, first, piece, overlap)
        placed = piece_kernels.place_pieces(*pieces, corner, pixel, in_world, clearance, config.min_radius, _MAX_VERTICES)
        regions += [
            PlanarRegion(-1, X_WR, boundary[:corners], inset[:inset_corners])
            for X_WR, boundary, corners, inset, inset_corners in zip(*placed, strict=True)
        ]
    return regions


def _window(own: np.ndarray, margin: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns first and past-the-last row and column of the cells that are True, and ``margin`` cells around them."""
    rows, columns = np.flatnonzero(own.any(axis=1)), np.flatnonzero(own.any(axis=0))
    low = np.array([rows[0], columns[0]]) - margin
    high = np.array([rows[-1], columns[-1]]) + margin + 1
    return np.maximum(low, 0), np.minimum(high, own.shape)


def _upsampled(mask: np.ndarray, n: int) -> np.ndarray:
    """Returns ``mask``, bool or uint8, with n x n pixels a cell and its stairs smoothed, uint8 0 or 1."""
    rows, columns = mask.shape
    fine = cv2.resize(mask.astype(np.float32), (n * columns, n * rows), interpolation=cv2.INTER_LINEAR)
    return (fine > 0.6).astype(np.uint8)  # so that neither an outer nor an inner corner is rounded into ground


def _with_ids(stamp: float, found: list[PlanarRegion], previous: PlaneRegions) -> PlaneRegions:
    """Returns the regions with the ids of those that were in the same place before, one to one, or new ones."""
    ids = [-1] * len(found)
    before = previous.regions.regions
    if found and before:
        old, new = (np.array([region.center for region in regions]) for regions in (before, found))
        distance, nearest = cKDTree(old).query(new, distance_upper_bound=_SAME_PLACE)
        taken = set()
        for k in np.argsort(distance, kind="stable").tolist():
            if np.isfinite(distance[k]) and nearest[k] not in taken:
                taken.add(nearest[k])
                ids[k] = before[nearest[k]].id
    next_id, regions = previous.next_id, []
    for region, known in zip(found, ids, strict=True):
        regions.append(PlanarRegion(known if known >= 0 else next_id, region.X_WR, region.boundary, region.inset))
        next_id += known < 0
    return PlaneRegions(RegionSet(stamp, tuple(regions)), next_id)
