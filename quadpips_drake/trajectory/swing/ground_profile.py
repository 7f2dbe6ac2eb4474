"""The ground below a swing, from what is known of it: how high the foot has to be where."""

import numpy as np

SAMPLES = 25
"""Equal parts of the way [1]: 0 at lift-off, 1 at touch-down."""
_PARTS = np.linspace(0.0, 1.0, SAMPLES)
_STEP = 0.02
"""A height difference between both ends of more than this [m] is taken for a step, not for a slope."""
_LATEST_EDGE = 0.25
"""Where nothing is known, the edge of a step lies this part of the way or farther from the lower foothold [1]."""


def ground_profile(p0, p1, regions=(), foot_radius: float = 0.0) -> np.ndarray:
    """Lowest admissible heights of the foot centre on the straight way from ``p0`` to ``p1``, (SAMPLES,) [m] in W.

    Known regions count where the way leads over them, widened by the foot's radius. Elsewhere the ground is unknown: between
    ends at different heights a step is expected that lies as close to the lower one as is likely.

    Args:
        p0, p1: foot centres at lift-off and touch-down [m], (3,).
        regions: PlanarRegions around the way; others do not matter.
        foot_radius: [m].
    """
    p0, p1 = np.asarray(p0, dtype=float), np.asarray(p1, dtype=float)
    if not regions:
        return _expected(p0[2], p1[2], _PARTS)
    points = p0[:2] + _PARTS[:, None] * (p1 - p0)[:2]
    profile = np.full(SAMPLES, -np.inf)
    for region in regions:
        covered, heights = _heights_over(region, points, foot_radius)
        profile[covered] = np.maximum(profile[covered], heights[covered])
    unknown = np.isneginf(profile)
    if unknown.any():
        profile[unknown] = _expected(p0[2], p1[2], _PARTS)[unknown]
    # The foot does stand at both ends, whatever the regions' planes say.
    profile[0], profile[-1] = p0[2], p1[2]
    return profile


def _heights_over(region, points, foot_radius):
    """Which of the points (n, 2) lie over the region, and the height of a foot centre on its plane there."""
    normals, offsets = region_halfspaces(region)
    n, center = region.normal, region.center
    heights = center[2] + (foot_radius - (points - center[:2]) @ n[:2]) / n[2]
    on_plane = np.column_stack((points, heights))
    return (on_plane @ normals.T + offsets >= -foot_radius).all(axis=1), heights


def _expected(start, end, parts):
    if abs(end - start) < _STEP:
        return start + parts * (end - start)
    from_lower = parts if end > start else 1.0 - parts
    return np.where(from_lower < _LATEST_EDGE, min(start, end), max(start, end))


def region_halfspaces(region) -> tuple[np.ndarray, np.ndarray]:
    """Returns normals (m, 3), offsets (m,): normals @ p + offsets >= 0 for points p (in W) above or on the region."""
    corners = np.asarray(region.boundary)
    edges = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(edges, axis=1)
    corners, edges = corners[length > 1e-9], edges[length > 1e-9] / length[length > 1e-9, None]
    inward = np.column_stack((-edges[:, 1], edges[:, 0]))  # left of a counter-clockwise edge
    rotation = region.X_WR[:3, :3]
    normals = inward @ rotation[:, :2].T
    return normals, -np.einsum("ij,ij->i", inward, corners) - normals @ region.center
