"""Carries labels from the image they were predicted for to a later image: stale labels ride along with the points.

The network labels five images a second (QuadPiPS section IV), the egocan takes in more. A point of the newer image gets the
label that the same point of the world had in the labelled image.
"""

import numpy as np
from numba import njit

from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.sensing import CameraIntrinsics
from quadpips_drake.values.steppability import Steppability

_TOLERANCE = 0.02
"""Largest difference of depth at which two measurements are the same point [m] ..."""
_RELATIVE_TOLERANCE = 0.03
"""... plus this share of the depth."""


def transfer_labels(depth: np.ndarray, X_WC: np.ndarray, intrinsics: CameraIntrinsics, labelled: LabelImage) -> np.ndarray:
    """Returns Steppability for each pixel of ``depth``, uint8 (height, width); UNKNOWN where the labelled image knows none.

    Args:
        depth: of the newer image [m], (height, width); NaN, inf and 0 are invalid.
        X_WC: pose of its optical frame, (4, 4).
        intrinsics: of both images.
        labelled: an older image of the same camera. Without ``depth`` and ``X_WC`` of its own its labels are taken pixel by
            pixel, as if the camera stood still.
    """
    if labelled.labels.shape != depth.shape:
        return np.full(depth.shape, Steppability.UNKNOWN, np.uint8)
    if labelled.X_WC is None or labelled.depth is None:
        return np.array(labelled.labels)
    X_LC = np.linalg.inv(labelled.X_WC) @ X_WC
    if not np.isfinite(X_LC).all() or labelled.depth.shape != depth.shape:
        return np.full(depth.shape, Steppability.UNKNOWN, np.uint8)
    result = np.empty(depth.shape, np.uint8)
    k = intrinsics
    camera = np.array([k.fx, k.fy, k.cx, k.cy], np.float32)
    _transfer(
        np.ascontiguousarray(depth, np.float32),
        X_LC.astype(np.float32),
        camera,
        np.ascontiguousarray(labelled.depth, np.float32),
        np.ascontiguousarray(labelled.labels),
        result,
    )
    return result


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _project(depth, b, X_LC, camera, rows, index, z_old):
    """Writes where the points of one image row appear in the older image: pixel (flat index) and depth, NaN if nowhere.

    ``b``: y/z of the row. ``rows``: of the older image. Free of branches, so that the compiler handles many columns at once.
    """
    fx, fy, cx, cy = camera
    pitch_u = np.float32(1.0) / fx
    (r00, r01, r02, p0), (r10, r11, r12, p1), (r20, r21, r22, p2) = X_LC[0], X_LC[1], X_LC[2]
    half, nearest, farthest, nothing = np.float32(0.5), np.float32(1e-3), np.float32(1e3), np.float32(0.0)
    width = np.int32(depth.shape[0])
    right, bottom = np.float32(width), np.float32(rows)
    for u in range(depth.shape[0]):
        z = depth[u]
        a = (np.float32(u) - cx) * pitch_u
        z_there = z * (r20 * a + r21 * b + r22) + p2
        inverse = np.float32(1.0) / z_there
        column = (z * (r00 * a + r01 * b + r02) + p0) * inverse * fx + cx + half
        row = (z * (r10 * a + r11 * b + r12) + p1) * inverse * fy + cy + half
        seen = (z > 0) & (z < farthest) & (z_there > nearest)
        seen &= (column >= 0) & (column < right) & (row >= 0) & (row < bottom)
        column, row = column if seen else nothing, row if seen else nothing
        index[u] = np.int32(row) * width + np.int32(column)
        z_old[u] = z_there if seen else np.float32(np.nan)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _look_up(index, z_old, old_depth, old_labels, result):
    """Writes the labels of the older image's pixels ``index`` where its depth is ``z_old`` within the tolerance, else 0."""
    tolerance, relative = np.float32(_TOLERANCE), np.float32(_RELATIVE_TOLERANCE)
    for u in range(result.shape[0]):
        i = np.uint32(index[u])
        same = abs(old_depth[i] - z_old[u]) <= tolerance + relative * z_old[u]
        result[u] = old_labels[i] if same else 0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _transfer(depth, X_LC, camera, old_depth, old_labels, result):
    """Looks each point up in the older image; ``X_LC`` leads from the newer optical frame to the older one."""
    rows, columns = depth.shape
    index, z_old = np.empty(columns, np.int32), np.empty(columns, np.float32)
    flat_depth, flat_labels = old_depth.ravel(), old_labels.ravel()
    pitch_v = np.float32(1.0) / camera[1]
    for v in range(rows):
        _project(depth[v], (np.float32(v) - camera[3]) * pitch_v, X_LC, camera, rows, index, z_old)
        _look_up(index, z_old, flat_depth, flat_labels, result[v])
