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


@njit(cache=True)
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
    u = focal[0] * (R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz) / z_C + focal[2]
    v = focal[1] * (R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz) / z_C + focal[3]
    if not (0 <= u < depth.shape[1] - 1 and 0 <= v < depth.shape[0] - 1):
        return HIDDEN
    i, j = int(v), int(u)
    measured, behind = 0, 0
    for row in range(i, i + 2):
        for column in range(j, j + 2):
            d = depth[row, column]
            if not d > 0.0:
                continue
            if d < z_C - margin:
                return HIDDEN
            measured += 1
            behind += d > z_C + margin
    if measured < 2:
        return HIDDEN
    return THROUGH if behind == measured else EXPOSED


@njit(cache=True)
def sees_through(x, y, z, depth, camera, margin):
    """Whether the image shows something clearly behind the point (x, y, z) of W."""
    return look_at(x, y, z, depth, camera, margin) == THROUGH
