"""What a region may hold, in NumPy: the readable version of what the region kernels ensure."""

import cv2
import numpy as np


def void_on_plane(superpixels, region, config):
    """Plane coordinates (n, 2) in R of all pixels of the cap that must not be in ``region``, and of a rim around the cap."""
    rows, columns = superpixels.assignment.shape
    X_RE = np.linalg.inv(region.X_WR) @ superpixels.X_WE
    square = np.ones((config.max_speck + 1, config.max_speck + 1), np.uint8)
    ground = cv2.morphologyEx(superpixels.healthy.astype(np.uint8), cv2.MORPH_CLOSE, square).astype(bool)
    with np.errstate(invalid="ignore"):
        off_plane = np.abs(superpixels.points @ X_RE[2, :3] + X_RE[2, 3]) > config.max_off_plane
    void = np.pad(~ground | off_plane, 1, constant_values=True)
    v, u = np.nonzero(void)
    # Where the ray of the pixel, p(y) = (du (a + b y), y, dv (a + b y)), meets the plane.
    a, b = superpixels.cap_rays
    du, dv = u - 1 - columns // 2, v - 1 - rows // 2
    start = np.column_stack([du * a, np.zeros(len(u)), dv * a])
    along = np.column_stack([du * b, np.ones(len(u)), dv * b])
    y = -(start @ X_RE[2, :3] + X_RE[2, 3]) / (along @ X_RE[2, :3])
    return ((start + y[:, None] * along) @ X_RE[:3, :3].T + X_RE[:3, 3])[:, :2]
