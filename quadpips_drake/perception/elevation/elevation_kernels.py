"""The inner loops of the elevation map (elevation_mapping.py). Cameras are packed by ``view_kernels.pack_camera``.

An image enters in two steps: ``collect_heights`` makes one height per cell of its points, ``fuse_heights`` fuses these with
what the map holds.
"""

import numpy as np
from numba import njit

from quadpips_drake.perception.egocan.ground_kernels import flies
from quadpips_drake.perception.egocan.view_kernels import THROUGH, locate_row, look_at

MIN_POINTS = 2
"""Points in one cell of one image that it takes to make a new surface."""


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp"})
def _place_row(depth, b, lens, R, origin, limits, sigmas, x, y, height, variance):
    """Writes where the points of one image row lie: x, y in cells, height above the camera [m], and its variance [m^2].

    The height is NaN where there is no point to use. ``b``: y/z of the row. The variance is that of the depth as far as it
    shifts the point up or down. Free of branches, for many columns at once.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = R[0], R[1], R[2]
    pitch_u, cx, x0, y0 = lens[0], lens[2], origin[0], origin[1]
    nearest, farthest = limits
    bx, by, bz = r01 * b + r02, r11 * b + r12, r21 * b + r22
    for u in range(depth.shape[0]):
        z = depth[u]
        a = (np.float32(u) - cx) * pitch_u
        rise = r20 * a + bz
        above = z * rise
        x[u] = x0 + z * (r00 * a + bx)
        y[u] = y0 + z * (r10 * a + by)
        sigma = (sigmas[0] + sigmas[1] * z * z) * rise
        variance[u] = sigma * sigma
        height[u] = above if (z >= nearest) & (z <= farthest) & (above < 0) else np.float32(np.nan)


@njit(cache=True, nogil=True, error_model="numpy")
def collect_heights(depth, camera, first_cell, cell, limits, sigmas, layer, total):
    """Sums the points of an image per cell, those within ``layer`` of the highest one of the cell.

    Args:
        depth: [m], float32 (height, width).
        camera: packed.
        first_cell, cell: the window of cells.
        limits: nearest and farthest depth to use [m].
        sigmas: deviation of the depth at zero depth [m] and its growth with the squared depth [1/m].
        layer: [m].
        total: number, sum of heights above the camera and sum of variances, zero at first, float32 (n, n, 3).
    """
    R, p, focal = camera
    rows, columns = depth.shape
    lens = (np.float32(1.0 / focal[0]), np.float32(1.0 / focal[1]), np.float32(focal[2]), np.float32(focal[3]))
    per_cell = 1.0 / cell
    origin = (np.float32(p[0] * per_cell - first_cell[0]), np.float32(p[1] * per_cell - first_cell[1]))
    R_cells = (R * np.array([[per_cell], [per_cell], [1.0]])).astype(np.float32)
    near_far = (np.float32(limits[0]), np.float32(limits[1]))
    deviations = (np.float32(sigmas[0]), np.float32(sigmas[1]))
    n = total.shape[0]
    side = np.float32(n)
    x, y = np.empty(columns, np.float32), np.empty(columns, np.float32)
    height, variance = np.empty((rows, columns), np.float32), np.empty((rows, columns), np.float32)
    where = np.empty((rows, columns), np.int32)
    top = np.full(n * n, np.float32(-np.inf))
    for v in range(rows):
        b = (np.float32(v) - lens[3]) * lens[1]
        _place_row(depth[v], b, lens, R_cells, origin, near_far, deviations, x, y, height[v], variance[v])
        for u in range(columns):
            z = height[v, u]
            inside = (z == z) & (x[u] >= 0) & (x[u] < side) & (y[u] >= 0) & (y[u] < side)
            if not inside:
                where[v, u] = -1
                continue
            k = np.int32(x[u]) * np.int32(n) + np.int32(y[u])
            where[v, u] = k
            top[k] = max(top[k], z)
    sums = total.reshape(-1, 3)
    for v in range(rows):
        for u in range(columns):
            k = where[v, u]
            if k >= 0 and height[v, u] >= top[k] - np.float32(layer):
                sums[k, 0] += np.float32(1.0)
                sums[k, 1] += height[v, u]
                sums[k, 2] += variance[v, u]


@njit(cache=True, nogil=True, error_model="numpy")
def fuse_heights(total, depth, camera, first_cell, cell, rule, cleans, height, variance):
    """Fuses the sums of one image with the map, cell by cell, in place.

    - A height within the gate of the cell's is fused with it as a Kalman filter does.
    - One outside of the gate makes the cell less certain, until the gate is wide enough or nothing of the cell is left; but
      not one below a surface that the image does not see through.
    - A surface where there was none, or a higher one, is an outlier when the image sees through all of its cell.
    - If the image ``cleans``, it removes what it sees through: the surface of a cell in which it has no point, and one above
      the height that it has there, which then takes its place.

    ``rule``: least and greatest variance, gate, variance for a height that is not fused, see_through.
    """
    p = camera[1]
    least, greatest, gate, unfused, margin = rule
    rows, columns = height.shape
    pixel, distance = np.empty(columns, np.int32), np.empty(columns)
    for i in range(rows):
        x = (first_cell[0] + i + 0.5) * cell
        if cleans:
            locate_row(x, first_cell[1] + 0.5, cell, height[i], camera, depth.shape[0], depth.shape[1], pixel, distance)
        for j in range(columns):
            y, n, old = (first_cell[1] + j + 0.5) * cell, total[i, j, 0], height[i, j]
            known = old == old
            if n == 0:
                if cleans and known and pixel[j] >= 0 and look_at(x, y, old, depth, camera, margin) == THROUGH:
                    height[i, j], variance[i, j] = np.nan, np.nan
                continue
            new, spread = p[2] + total[i, j, 1] / n, max(total[i, j, 2] / (n * n), least)
            if known:
                off, both = new - old, variance[i, j] + spread
                if off * off <= gate * gate * both:
                    height[i, j] = old + off * variance[i, j] / both
                    variance[i, j] = max(variance[i, j] * spread / both, least)
                    continue
                if off < 0 and look_at(x, y, old, depth, camera, margin) != THROUGH:  # from the side, below a slab
                    continue
                variance[i, j] += unfused
                if variance[i, j] < greatest and not (off < 0 and cleans):
                    continue
            elif n < MIN_POINTS:
                continue
            if not (known and new < old) and flies(x, y, new, cell, depth, camera, margin):
                continue
            height[i, j], variance[i, j] = new, spread
