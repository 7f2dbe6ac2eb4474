"""Superpixels from frame to frame: clusters to begin with, and ids that stay with a piece of ground."""

import numpy as np
from numba import njit

from quadpips_drake.values.images import EgocanImage, SuperpixelImage

MIN_OVERLAP = 0.5
"""A superpixel keeps an id when it shares at least this part of the smaller of the two with that id's old superpixel."""

MAX_WANDER = 0.15
"""The centroid of an id's superpixel stays within this distance of where it was when the id was given [m]."""


def can_follow(previous: SuperpixelImage | None, can: EgocanImage, max_jump: float, max_turn: float) -> bool:
    """Whether ``can`` shows the ground of ``previous`` from nearby: no jump of the pose [m, rad], nor back in time."""
    if previous is None or previous.assignment.shape != can.cap_height.shape or not len(previous.clusters):
        return False
    if not can.stamp >= previous.stamp or not np.isfinite(can.X_WE).all():
        return False
    moved = np.linalg.norm(can.X_WE[:3, 3] - previous.X_WE[:3, 3])
    turned = np.arccos(np.clip(can.X_WE[:3, 2] @ previous.X_WE[:3, 2], -1.0, 1.0))
    return bool(moved <= max_jump and turned <= max_turn)


def clusters_in_world(clusters: np.ndarray, X_WE: np.ndarray) -> np.ndarray:
    """Returns points, normals (in W) and pixels, (k, 7), of ``clusters`` (k, 9) in E, less those that lost all pixels."""
    alive = clusters[np.isfinite(clusters).all(axis=1)]
    R_WE = X_WE[:3, :3]
    return np.hstack([alive[:, 2:5] @ R_WE.T + X_WE[:3, 3], alive[:, 5:8] @ R_WE.T, alive[:, 8:]])


def propagate_clusters(previous: SuperpixelImage, can: EgocanImage) -> np.ndarray:
    """Returns the clusters (k, 9) of ``previous`` in the frame and on the cap of ``can``: moved by the base's motion."""
    R_WE = can.X_WE[:3, :3]
    p_E = (previous.clusters[:, :3] - can.X_WE[:3, 3]) @ R_WE
    n_E = previous.clusters[:, 3:6] @ R_WE
    base, growth = can.cap_rays
    rows, columns = can.cap_height.shape
    pixel = np.maximum(base + growth * p_E[:, 1], 1e-6)
    u, v = np.rint(p_E[:, 0] / pixel) + columns // 2, np.rint(p_E[:, 2] / pixel) + rows // 2
    return np.column_stack([u, v, p_E, n_E, previous.clusters[:, 6]])


def keep_ids(
    previous: SuperpixelImage | None,
    follows: bool,
    assignment: np.ndarray,
    points: np.ndarray,
    centers_W: np.ndarray,
    X_WE: np.ndarray,
    max_step: float,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Returns the ids of the superpixels, int64 (k,), their homes in W (k, 3), and the least id that was never given.

    A superpixel takes the id of the old one that lies on the same ground: pairs are matched one to one in the order of the
    pixels they share in the world (within ``max_step`` [m] in height), as long as the centroid (``centers_W`` (k, 3) [m])
    stays near the id's home, where it was when the id was given. All others, and all if the frame does not follow
    (``follows``) the previous one, get ids that no ground had before.
    """
    next_id = 0 if previous is None else previous.next_id
    count = len(centers_W)
    ids, homes = np.full(count, -1, np.int64), np.array(centers_W)
    if follows and count and len(previous.ids):
        old_count = len(previous.ids)
        X_old = np.linalg.inv(previous.X_WE) @ X_WE
        old = (previous.cap_rays, previous.assignment, previous.points, old_count)
        shared, sizes, old_sizes = count_shared_pixels(assignment, points, count, X_old, *old, max_step)
        enough = shared >= np.maximum(1, MIN_OVERLAP * np.minimum.outer(sizes, old_sizes))
        pairs = _largest_first(shared, enough)
        at_home = np.linalg.norm(centers_W[pairs[:, 0]] - previous.homes[pairs[:, 1]], axis=1) <= MAX_WANDER
        # In lists, which are faster than arrays to look into one by one.
        matched, taken = [-1] * count, [False] * old_count
        for c, o in pairs[at_home].tolist():
            if matched[c] < 0 and not taken[o]:
                matched[c], taken[o] = o, True
        kept = np.flatnonzero(np.array(matched) >= 0)
        old_of = np.array(matched)[kept]
        ids[kept], homes[kept] = previous.ids[old_of], previous.homes[old_of]
    fresh = np.flatnonzero(ids < 0)
    ids[fresh] = next_id + np.arange(len(fresh))
    return ids, homes, next_id + len(fresh)


def _largest_first(shared: np.ndarray, chosen: np.ndarray):
    """Returns the ``chosen`` pairs (new, old) in the order of the pixels they share, most first, int64 (n, 2)."""
    pairs = np.argwhere(chosen)
    return pairs[np.argsort(-shared[chosen], kind="stable")]


@njit(cache=True, nogil=True, error_model="numpy")
def _locate_row(points, X_old, rays, rows, columns, height, pixel):
    """Writes where the points of a row of pixels, (3 n,), lie on the old cap of (rows, columns): flat index of the pixel,
    int32, -1 if beside it, and |y| there; free of branches. ``X_old``, ``rays``: see ``count_shared_pixels``."""
    (x00, x01, x02, x03), (x10, x11, x12, x13), (x20, x21, x22, x23) = X_old[0], X_old[1], X_old[2]
    base, growth, middle_u, middle_v = rays[0], rays[1], columns // 2, rows // 2
    for k in range(len(pixel)):
        p0, p1, p2 = points[3 * k], points[3 * k + 1], points[3 * k + 2]
        y = x10 * p0 + x11 * p1 + x12 * p2 + x13
        side = base + growth * y
        x = x00 * p0 + x01 * p1 + x02 * p2 + x03
        z = x20 * p0 + x21 * p1 + x22 * p2 + x23
        a, b = np.floor(x / side + 0.5) + middle_u, np.floor(z / side + 0.5) + middle_v
        inside = (side > 0) & (a >= 0) & (a < columns) & (b >= 0) & (b < rows)
        a, b = a if inside else 0.0, b if inside else 0.0
        height[k] = y
        pixel[k] = np.int32(b) * np.int32(columns) + np.int32(a) if inside else np.int32(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def count_shared_pixels(assignment, points, count, X_old, rays, old_assignment, old_points, old_count, max_step):
    """Returns how many pixels each superpixel shares with each old one, int32 (count, old_count), and has, and the old has.

    ``X_old``: pose of the new frame E in the old one, (4, 4); ``rays``: of the old cap.
    """
    shared = np.zeros((count, old_count), np.int32)
    sizes, old_sizes = np.zeros(count, np.int32), np.zeros(old_count, np.int32)
    height, pixel = np.empty(assignment.shape[1]), np.empty(assignment.shape[1], np.int32)
    flat_old, flat_points = old_assignment.ravel(), old_points.reshape(-1, 3)
    for o in flat_old:
        if o >= 0:
            old_sizes[o] += 1
    for v in range(assignment.shape[0]):
        _locate_row(points[v].reshape(-1), X_old, rays, *old_assignment.shape, height, pixel)
        for u in range(assignment.shape[1]):
            c, k = assignment[v, u], pixel[u]
            if c < 0:
                continue
            sizes[c] += 1
            if k >= 0 and flat_old[k] >= 0 and abs(flat_points[k, 1] - height[u]) <= max_step:
                shared[c, flat_old[k]] += 1
    return shared, sizes, old_sizes
