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
        for c, o in _largest_first(shared, enough):
            at_home = np.linalg.norm(centers_W[c] - previous.homes[o]) <= MAX_WANDER
            if ids[c] < 0 and at_home and previous.ids[o] not in ids:
                ids[c], homes[c] = previous.ids[o], previous.homes[o]
    fresh = np.flatnonzero(ids < 0)
    ids[fresh] = next_id + np.arange(len(fresh))
    return ids, homes, next_id + len(fresh)


def _largest_first(shared: np.ndarray, chosen: np.ndarray):
    """Returns the ``chosen`` pairs (new, old) in the order of the pixels they share, most first, int64 (n, 2)."""
    pairs = np.argwhere(chosen)
    return pairs[np.argsort(-shared[chosen], kind="stable")]


@njit(cache=True)
def count_shared_pixels(assignment, points, count, X_old, rays, old_assignment, old_points, old_count, max_step):
    """Returns how many pixels each superpixel shares with each old one, int32 (count, old_count), and has, and the old has.

    ``X_old``: pose of the new frame E in the old one, (4, 4); ``rays``: of the old cap.
    """
    rows, columns = old_assignment.shape
    shared = np.zeros((count, old_count), np.int32)
    sizes, old_sizes = np.zeros(count, np.int32), np.zeros(old_count, np.int32)
    for v in range(rows):
        for u in range(columns):
            if old_assignment[v, u] >= 0:
                old_sizes[old_assignment[v, u]] += 1
    for v in range(assignment.shape[0]):
        for u in range(assignment.shape[1]):
            c = assignment[v, u]
            if c < 0:
                continue
            sizes[c] += 1
            p0, p1, p2 = points[v, u, 0], points[v, u, 1], points[v, u, 2]
            y = X_old[1, 0] * p0 + X_old[1, 1] * p1 + X_old[1, 2] * p2 + X_old[1, 3]
            pixel = rays[0] + rays[1] * y
            if not pixel > 0:
                continue
            x = X_old[0, 0] * p0 + X_old[0, 1] * p1 + X_old[0, 2] * p2 + X_old[0, 3]
            z = X_old[2, 0] * p0 + X_old[2, 1] * p1 + X_old[2, 2] * p2 + X_old[2, 3]
            a, b = int(np.floor(x / pixel + 0.5)) + columns // 2, int(np.floor(z / pixel + 0.5)) + rows // 2
            if 0 <= a < columns and 0 <= b < rows and old_assignment[b, a] >= 0 and abs(old_points[b, a, 1] - y) <= max_step:
                shared[c, old_assignment[b, a]] += 1
    return shared, sizes, old_sizes
