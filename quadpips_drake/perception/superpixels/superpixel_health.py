"""The inner loops of the health check: which pixels of the cap may carry a foot (QuadPiPS section V-D.1)."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def check_health(height, normals, labels, allowed, rays, max_depth, min_upward, max_step):
    """Returns (points (h, w, 3) in E, healthy (h, w)) of a cap; see superpixels.healthy_pixels for what is healthy.

    ``allowed`` (256,): whether pixels of a label may be stepped on. ``rays``: of the cap (EgocanImage.cap_rays).
    """
    rows, columns = height.shape
    points = np.empty((rows, columns, 3), np.float32)
    plausible = np.zeros((rows, columns), np.bool_)
    base, growth = np.float32(rays[0]), np.float32(rays[1])
    for v in range(rows):
        for u in range(columns):
            y = height[v, u]
            pixel = base + growth * y
            points[v, u, 0] = pixel * np.float32(u - columns // 2) if y == y else y
            points[v, u, 1] = y
            points[v, u, 2] = pixel * np.float32(v - rows // 2) if y == y else y
            plausible[v, u] = 0 < y <= max_depth and -normals[v, u, 1] >= min_upward and allowed[labels[v, u]]
    return points, supported_pixels(points, normals, plausible, max_step)


@njit(cache=True, nogil=True)
def supported_pixels(points, normals, plausible, max_step):
    """Returns the ``plausible`` pixels that continue to at least two of their four neighbours, bool (h, w).

    A neighbour continues a pixel when it is plausible and within ``max_step`` [m] of its tangent plane.
    """
    rows, columns = plausible.shape
    supported = np.zeros((rows, columns), np.bool_)
    for v in range(rows):
        for u in range(columns):
            if not plausible[v, u]:
                continue
            n0, n1, n2 = normals[v, u, 0], normals[v, u, 1], normals[v, u, 2]
            offset = n0 * points[v, u, 0] + n1 * points[v, u, 1] + n2 * points[v, u, 2]
            count = 0
            for b, a in ((v - 1, u), (v + 1, u), (v, u - 1), (v, u + 1)):
                if 0 <= b < rows and 0 <= a < columns and plausible[b, a]:
                    off = n0 * points[b, a, 0] + n1 * points[b, a, 1] + n2 * points[b, a, 2] - offset
                    count += abs(off) <= max_step
            supported[v, u] = count >= 2
    return supported
