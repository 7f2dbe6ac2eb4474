"""What a depth image says about a place in the world, for the inner loops of the egocan."""

import numpy as np
from numba import njit

HIDDEN = 0
"""Nothing is said: the place is out of view, behind something, or not measured."""
EXPOSED = 1
"""The image shows a surface at about that depth."""
THROUGH = 2
"""The image shows something clearly behind."""

_NEAREST = 0.05
"""Places closer to the camera's plane than this are out of view [m]."""


def pack_camera(X_WC, intrinsics):
    """Returns the camera in the form that the kernels take: R_WC (3, 3), p_WC (3,), (fx, fy, cx, cy)."""
    focal = np.array([intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy])
    return np.ascontiguousarray(X_WC[:3, :3]), np.ascontiguousarray(X_WC[:3, 3]), focal


@njit(cache=True, nogil=True, error_model="numpy")
def judge(a, b, c, d, z_C, margin):
    """Returns HIDDEN, EXPOSED or THROUGH for a place at depth ``z_C``, from the depths of the four pixels around it.

    At least two of the four must be measured: noise loses single pixels. THROUGH takes all measured ones to lie more than
    ``margin`` [m] behind, and a single one as much in front hides the place. Depth +inf, "nothing in range", lies behind;
    NaN and 0 are not measured.
    """
    nearer, farther = np.float32(z_C - margin), np.float32(z_C + margin)
    nothing = np.float32(0.0)
    measured = (a > nothing) + (b > nothing) + (c > nothing) + (d > nothing)
    behind = (a > farther) + (b > farther) + (c > farther) + (d > farther)
    in_front = measured - ((a >= nearer) + (b >= nearer) + (c >= nearer) + (d >= nearer))
    if in_front > 0 or measured < 2:
        return HIDDEN
    return THROUGH if behind == measured else EXPOSED


@njit(cache=True, nogil=True, error_model="numpy")
def look_at(x, y, z, depth, camera, margin):
    """Returns HIDDEN, EXPOSED or THROUGH for the point (x, y, z) of W; see ``judge``."""
    R, p, focal = camera
    dx, dy, dz = x - p[0], y - p[1], z - p[2]
    z_C = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz
    if z_C < _NEAREST:
        return HIDDEN
    inverse = 1.0 / z_C
    u = focal[0] * (R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz) * inverse + focal[2]
    v = focal[1] * (R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz) * inverse + focal[3]
    if not ((u >= 0) & (u < depth.shape[1] - 1) & (v >= 0) & (v < depth.shape[0] - 1)):
        return HIDDEN
    i, j = np.int64(v), np.int64(u)
    return judge(depth[i, j], depth[i, j + 1], depth[i + 1, j], depth[i + 1, j + 1], z_C, margin)


@njit(cache=True, nogil=True, error_model="numpy")
def locate_row(x, first, pitch, heights, camera, rows, columns, pixel, distance):
    """Writes where a row of places (x, (first + k) pitch, heights[k]) of W appears in an image of (rows, columns).

    ``pixel``: flat index of the upper left of the four pixels around a place, int32, -1 if it is out of view;
    ``distance``: its depth z_C [m]. Free of branches, so that the compiler can handle many places at once.
    """
    R, p, focal = camera
    dx = x - p[0]
    r00, r01, r02, r10, r11, r12 = R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2]
    r20, r21, r22 = R[2, 0], R[2, 1], R[2, 2]
    fx, fy, cx, cy = focal[0], focal[1], focal[2], focal[3]
    p1, p2 = p[1], p[2]
    right, bottom, width = columns - 1.0, rows - 1.0, np.int32(columns)
    for k in range(heights.shape[0]):
        dy, dz = (first + k) * pitch - p1, heights[k] - p2
        z_C = r02 * dx + r12 * dy + r22 * dz
        inverse = 1.0 / z_C
        u = fx * (r00 * dx + r10 * dy + r20 * dz) * inverse + cx
        v = fy * (r01 * dx + r11 * dy + r21 * dz) * inverse + cy
        seen = (z_C >= _NEAREST) & (u >= 0) & (u < right) & (v >= 0) & (v < bottom)
        u, v = u if seen else 0.0, v if seen else 0.0
        pixel[k] = np.int32(v) * width + np.int32(u) if seen else np.int32(-1)
        distance[k] = z_C
