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


@njit(cache=True, error_model="numpy")
def look_at(x, y, z, depth, camera, margin):
    """Returns HIDDEN, EXPOSED or THROUGH for the point (x, y, z) of W, from the four pixels around it.

    At least two of the four must be measured: noise loses single pixels. THROUGH takes all measured ones to lie more than
    ``margin`` [m] behind, and a single one as much in front hides the place. Depth +inf, "nothing in range", lies behind;
    NaN and 0 are not measured.
    """
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
    nearer, farther = np.float32(z_C - margin), np.float32(z_C + margin)
    a, b, c, d = depth[i, j], depth[i, j + 1], depth[i + 1, j], depth[i + 1, j + 1]
    nothing = np.float32(0.0)
    measured = (a > nothing) + (b > nothing) + (c > nothing) + (d > nothing)
    behind = (a > farther) + (b > farther) + (c > farther) + (d > farther)
    in_front = measured - ((a >= nearer) + (b >= nearer) + (c >= nearer) + (d >= nearer))
    if in_front > 0 or measured < 2:
        return HIDDEN
    return THROUGH if behind == measured else EXPOSED


@njit(cache=True)
def sees_through(x, y, z, depth, camera, margin):
    """Whether the image shows something clearly behind the point (x, y, z) of W."""
    return look_at(x, y, z, depth, camera, margin) == THROUGH
