"""The regions that perfect perception would find, from the terrain itself."""

import numpy as np
import shapely

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.stage_config import stage_rate
from quadpips_drake.perception.regions.region_source_config import RegionSourceConfig
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.regions import PlanarRegion

_MAX_SPLITS = 3
"""How often a piece of ground that is not convex is quartered."""


@configuration
class OracleRegionConfig(RegionSourceConfig):
    """Parameters of the regions from ground truth."""

    rate: float = stage_rate(20.0, on_demand=True)
    """How often regions are put out [Hz]; 0: whenever they are read."""
    cell: float = ranged(0.15, 0.02, 10.0)
    """Wanted side of an inset [m]; faces are cut into cells of about this size."""
    radius: float = ranged(1.9, 0.1, 20.0)
    """Regions whose centre is within this distance of the base (xy) are known [m]."""


def regions_from_terrain(
    terrain: Terrain, foot_radius: float, config: OracleRegionConfig, every_label: bool = False
) -> tuple[PlanarRegion, ...]:
    """Returns regions over all walkable faces of ``terrain``, or over faces of ``every_label``; ``foot_radius`` in [m].

    Each flat visible patch is shrunk by foot radius + margin and cut by a grid; a piece that is not convex is quartered
    until its parts are (and dropped at last). The boundary of a region is its inset grown by foot radius + margin.
    """
    clearance = foot_radius + config.margin
    regions = []
    for patch in GroundTruth(terrain).patches:
        if not (every_label or patch.is_walkable):
            continue
        X_WP = patch.frame()
        room = patch.in_plane(X_WP).buffer(-clearance, join_style="mitre")
        for piece in _cut_into_cells(room, config.cell):
            if piece.centroid.distance(piece.boundary) < config.min_radius:
                continue
            regions.append(_make_region(len(regions), piece, X_WP, clearance, int(patch.label)))
    return tuple(regions)


def centers_of(regions: tuple[PlanarRegion, ...]) -> np.ndarray:
    """Returns the centres of ``regions`` in W [m], (n, 3)."""
    return np.array([region.center for region in regions]).reshape(-1, 3)


def nearby_regions(
    regions: tuple[PlanarRegion, ...], p_WB: np.ndarray, radius: float, centers: np.ndarray | None = None
) -> tuple[PlanarRegion, ...]:
    """Returns the ``regions`` whose centres are within ``radius`` [m] of ``p_WB`` in the horizontal plane.

    ``centers``: ``centers_of`` the regions, for those who ask often.
    """
    if not regions or not np.all(np.isfinite(p_WB)):
        return ()
    centers = centers_of(regions) if centers is None else centers
    near = np.hypot(centers[:, 0] - p_WB[0], centers[:, 1] - p_WB[1]) <= radius
    return tuple(regions[k] for k in np.flatnonzero(near))


def _cut_into_cells(room, cell: float) -> list[shapely.Polygon]:
    """Returns convex pieces of ``room`` (any polygonal geometry) of about ``cell`` [m] side."""
    pieces = []
    for part in shapely.get_parts(room):
        if part.is_empty:
            continue
        x0, y0, x1, y1 = part.bounds
        columns, rows = max(1, round((x1 - x0) / cell)), max(1, round((y1 - y0) / cell))
        x, y = np.linspace(x0, x1, columns + 1), np.linspace(y0, y1, rows + 1)
        left, low = (a.ravel() for a in np.meshgrid(x[:-1], y[:-1]))
        right, high = (a.ravel() for a in np.meshgrid(x[1:], y[1:]))
        shapely.prepare(part)
        for piece in shapely.intersection(part, shapely.box(left, low, right, high)):
            pieces += _convex_parts(piece, _MAX_SPLITS)
    return pieces


def _convex_parts(geometry, splits: int) -> list[shapely.Polygon]:
    convex = []
    for part in shapely.get_parts(geometry):
        if not isinstance(part, shapely.Polygon) or part.area < 1e-6:
            continue
        if part.convex_hull.area - part.area < 1e-6:
            convex.append(part.convex_hull)
        elif splits > 0:
            x0, y0, x1, y1 = part.bounds
            xm, ym = (x0 + x1) / 2, (y0 + y1) / 2
            for quarter in shapely.box([x0, xm, x0, xm], [y0, y0, ym, ym], [xm, x1, xm, x1], [ym, ym, y1, y1]):
                convex += _convex_parts(part.intersection(quarter), splits - 1)
    return convex


def _make_region(index: int, inset: shapely.Polygon, X_WP: np.ndarray, clearance: float, label: int) -> PlanarRegion:
    """Returns the region of the convex polygon ``inset`` in the xy plane of frame P."""
    center = np.array([inset.centroid.x, inset.centroid.y])
    X_PR = np.eye(4)
    X_PR[:2, 3] = center
    boundary = inset.buffer(clearance, quad_segs=2)
    corners = [
        shapely.get_coordinates(shapely.orient_polygons(polygon.simplify(1e-4)))[:-1] - center
        for polygon in (boundary, inset)
    ]
    return PlanarRegion(id=index, X_WR=X_WP @ X_PR, boundary=corners[0], inset=corners[1], label=label)
