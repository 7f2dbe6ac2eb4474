"""The inner loops of the egocan's images: floor cap and cylinder. Cameras are packed by ``view_kernels.pack_camera``."""

import numpy as np
from numba import njit

from quadpips_drake.perception.egocan.view_kernels import THROUGH, look_at

NEAREST = 0.05
"""Points closer to the axis of the cylinder than this are not on it [m]."""
BORDER = 1e-9
"""Points closer to the border of a column than this are given to it by their angle [rad]."""


@njit(cache=True, nogil=True, error_model="numpy")
def draw_cap(ground_height, ground_normal, ground_label, first_cell, cell_size, X_WE, focal, height, normals, labels):
    """Draws the remembered cells onto the floor cap (equation 4); the highest surface on each ray wins.

    ``height`` comes filled with +inf and holds |y| where drawn. Each pixel gets the point where its own ray meets the plane
    of the cell, so that a slope does not turn into a staircase.
    """
    size = height.shape[0]
    middle = size // 2
    R = X_WE[:3, :3]
    reach = 0.505 * cell_size
    for i in range(ground_height.shape[0]):
        dx = (first_cell[0] + i + 0.5) * cell_size - X_WE[0, 3]
        for j in range(ground_height.shape[1]):
            y = X_WE[2, 3] - ground_height[i, j]
            if not y > 0.02:  # unknown, or not below the camera
                continue
            dy = (first_cell[1] + j + 0.5) * cell_size - X_WE[1, 3]
            x = R[0, 0] * dx + R[1, 0] * dy
            z = R[0, 2] * dx + R[1, 2] * dy
            scale = focal / y
            u, v = x * scale + middle, z * scale + middle
            g0, g1, g2 = ground_normal[i, j, 0], ground_normal[i, j, 1], ground_normal[i, j, 2]
            nx = R[0, 0] * g0 + R[1, 0] * g1
            ny = -g2
            nz = R[0, 2] * g0 + R[1, 2] * g1
            tilt_x, tilt_z = (nx / ny, nz / ny) if g2 > 0.5 else (0.0, 0.0)
            # Half the extent of the projected cell, to first order; y changes by -(tilt_x dx + tilt_z dz) across it.
            a, b = 1.0 + x / y * tilt_x, x / y * tilt_z
            half_u = reach * scale * (abs(a * R[0, 0] + b * R[0, 2]) + abs(a * R[1, 0] + b * R[1, 2]))
            a, b = z / y * tilt_x, 1.0 + z / y * tilt_z
            half_v = reach * scale * (abs(a * R[0, 0] + b * R[0, 2]) + abs(a * R[1, 0] + b * R[1, 2]))
            first_column, last_column = max(0, int(np.ceil(u - half_u))), min(size - 1, int(np.floor(u + half_u)))
            first_row, last_row = max(0, int(np.ceil(v - half_v))), min(size - 1, int(np.floor(v + half_v)))
            for row in range(first_row, last_row + 1):
                for column in range(first_column, last_column + 1):
                    du, dv = column - middle, row - middle
                    if du * du + dv * dv > middle * middle:  # that ray belongs to the cylinder
                        continue
                    y_pixel = y
                    if g2 > 0.5:
                        along = (nx * du + nz * dv) / focal + ny
                        y_plane = (nx * x + ny * y + nz * z) / along
                        if abs(y_plane - y) < cell_size:
                            y_pixel = y_plane
                    if y_pixel < height[row, column]:
                        height[row, column] = y_pixel
                        normals[row, column, 0] = nx
                        normals[row, column, 1] = ny
                        normals[row, column, 2] = nz
                        labels[row, column] = ground_label[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def known_pixels(points):
    """Returns the flat indices of the pixels of a cylinder that hold a point, (n,); ``points`` (h_cyl, w_cyl, 3)."""
    flat = points.reshape(-1, 3)
    known = np.empty(len(flat), np.int64)
    size = 0
    for k in range(len(flat)):
        if flat[k, 0] == flat[k, 0]:
            known[size] = k
            size += 1
    return known[:size]


@njit(cache=True, nogil=True, error_model="numpy")
def still_believed(chosen, points, depth, camera, margin):
    """Returns those of the ``chosen`` flat indices whose points, (h_cyl, w_cyl, 3) in W, the camera does not see through."""
    flat = points.reshape(-1, 3)
    kept = np.empty(len(chosen), np.int64)
    size = 0
    for k in chosen:
        x, y, z = np.float64(flat[k, 0]), np.float64(flat[k, 1]), np.float64(flat[k, 2])  # what look_at is compiled for
        if look_at(x, y, z, depth, camera, margin) != THROUGH:
            kept[size] = k
            size += 1
    return kept[:size]


@njit(cache=True, nogil=True, error_model="numpy")
def _column_of(x, z, columns):
    """Returns the column of the cylinder in whose direction (x, z) of E lies (equation 1)."""
    return int(np.arctan2(x, z) * columns / (2 * np.pi) + 0.5 * columns) % columns


@njit(cache=True, nogil=True, error_model="numpy")
def _row_of(down, rho, rows, v_fov):
    """Returns the row of the cylinder at which a point ``down`` below E at the range ``rho`` lies, or one out of it."""
    return int(down / rho * rows / v_fov + 0.5 * rows)


@njit(cache=True, nogil=True, error_model="numpy")
def move_cylinder(chosen, old_points, old_normals, old_labels, X_WE, v_fov, ranges, points, normals, labels):
    """Carries the old points of the ``chosen`` pixels (flat indices) over to the new pose (equation 3)."""
    rows, columns = ranges.shape
    flat_points, flat_normals, flat_labels = old_points.reshape(-1, 3), old_normals.reshape(-1, 3), old_labels.ravel()
    for k in chosen:
        dx, dy = flat_points[k, 0] - X_WE[0, 3], flat_points[k, 1] - X_WE[1, 3]
        down = X_WE[2, 3] - flat_points[k, 2]
        x_E, z_E = X_WE[0, 0] * dx + X_WE[1, 0] * dy, X_WE[0, 2] * dx + X_WE[1, 2] * dy
        rho = np.sqrt(x_E * x_E + z_E * z_E)
        if not rho > NEAREST or abs(down) >= 0.5 * v_fov * rho:
            continue
        u, v = _column_of(x_E, z_E, columns), _row_of(down, rho, rows, v_fov)
        if v < 0 or v >= rows or rho >= ranges[v, u]:
            continue
        ranges[v, u] = rho
        points[v, u] = flat_points[k]
        normals[v, u] = flat_normals[k]
        labels[v, u] = flat_labels[k]


@njit(cache=True, nogil=True, error_model="numpy")
def _cylinder_row(depth, a, b, camera, X_WE, v_fov, x_E, z_E, down, rho):
    """Writes where the points of one image row lie in E: x, z, how far below it, and the range, 0 if not on the cylinder.

    ``a``: x/z of the pixels; ``b``: y/z of the row. Free of branches, so that the compiler can handle many points at once.
    """
    R, p, _ = camera
    r00, r01, r02, r10, r11, r12 = R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2]
    r20, r21, r22 = R[2, 0], R[2, 1], R[2, 2]
    p0, p1, p2, e0, e1, e2 = p[0], p[1], p[2], X_WE[0, 3], X_WE[1, 3], X_WE[2, 3]
    x00, x10, x02, x12 = X_WE[0, 0], X_WE[1, 0], X_WE[0, 2], X_WE[1, 2]
    for k in range(depth.shape[0]):
        d = depth[k]
        dx = p0 + d * (r00 * a[k] + r01 * b + r02) - e0
        dy = p1 + d * (r10 * a[k] + r11 * b + r12) - e1
        below = e2 - (p2 + d * (r20 * a[k] + r21 * b + r22))
        x, z = x00 * dx + x10 * dy, x02 * dx + x12 * dy
        far = np.sqrt(x * x + z * z)
        on_cylinder = (d < np.inf) & (far > NEAREST) & (abs(below) < 0.5 * v_fov * far)
        x_E[k], z_E[k], down[k] = x, z, below
        rho[k] = far if on_cylinder else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def add_to_cylinder(depth, image_normals, image_labels, camera, stride, X_WE, v_fov, ranges, points, normals, labels):
    """Puts the points of an image onto the cylinder (equations 1 and 2).

    Neighbouring points mostly lie in one column, so a point is first held against the two borders of the last one's column:
    the arc tangent takes longer than all the rest.
    """
    R, p, focal = camera
    rows, columns = ranges.shape
    size = (depth.shape[1] + stride - 1) // stride
    x_E, z_E, down, rho = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    sampled, a = np.empty(size, np.float32), (np.arange(size) * stride - focal[2]) / focal[0]
    border = (np.arange(columns + 1) - 0.5 * columns) * (2 * np.pi / columns)
    s, c = np.sin(border), np.cos(border)
    column = 0
    for v in range(0, depth.shape[0], stride):
        b = (v - focal[3]) / focal[1]
        for k in range(size):
            sampled[k] = depth[v, k * stride]
        _cylinder_row(sampled, a, b, camera, X_WE, v_fov, x_E, z_E, down, rho)
        for k in range(size):
            if rho[k] == 0.0:
                continue
            x, z, least = x_E[k], z_E[k], BORDER * rho[k]
            if not (x * c[column] - z * s[column] > least and z * s[column + 1] - x * c[column + 1] > least):
                column = _column_of(x, z, columns)
            row = _row_of(down[k], rho[k], rows, v_fov)
            if row < 0 or row >= rows or rho[k] >= ranges[row, column]:
                continue
            u = k * stride
            m0, m1, m2 = image_normals[v, u, 0], image_normals[v, u, 1], image_normals[v, u, 2]
            ranges[row, column] = rho[k]
            for i in range(3):
                points[row, column, i] = p[i] + sampled[k] * (R[i, 0] * a[k] + R[i, 1] * b + R[i, 2])
                normals[row, column, i] = R[i, 0] * m0 + R[i, 1] * m1 + R[i, 2] * m2
            labels[row, column] = image_labels[v, u]
