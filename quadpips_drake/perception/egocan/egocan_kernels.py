"""The inner loops of the egocan's images: floor cap and cylinder. Cameras are packed by ``view_kernels.pack_camera``."""

import numpy as np
from numba import njit

from quadpips_drake.perception.egocan.view_kernels import sees_through


@njit(cache=True)
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


@njit(cache=True, inline="always")
def _onto_cylinder(x, y, z, n0, n1, n2, label, X_WE, v_fov, ranges, points, normals, labels):
    """Puts a point of W onto the cylinder if it belongs there and nothing nearer is in its pixel."""
    rows, columns = ranges.shape
    dx, dy = x - X_WE[0, 3], y - X_WE[1, 3]
    down = X_WE[2, 3] - z
    x_E = X_WE[0, 0] * dx + X_WE[1, 0] * dy
    z_E = X_WE[0, 2] * dx + X_WE[1, 2] * dy
    rho = np.sqrt(x_E * x_E + z_E * z_E)
    if not rho > 0.05 or abs(down) >= 0.5 * v_fov * rho:
        return
    u = int(np.arctan2(x_E, z_E) * columns / (2 * np.pi) + 0.5 * columns) % columns
    v = int(down / rho * rows / v_fov + 0.5 * rows)
    if v < 0 or v >= rows or rho >= ranges[v, u]:
        return
    ranges[v, u] = rho
    points[v, u, 0], points[v, u, 1], points[v, u, 2] = x, y, z
    normals[v, u, 0], normals[v, u, 1], normals[v, u, 2] = n0, n1, n2
    labels[v, u] = label


@njit(cache=True)
def drop_disproved(points, depth, camera, margin):
    """Makes those points (h_cyl, w_cyl, 3) of W unknown through which the camera now sees."""
    for v in range(points.shape[0]):
        for u in range(points.shape[1]):
            x, y, z = points[v, u, 0], points[v, u, 1], points[v, u, 2]
            if x == x and sees_through(x, y, z, depth, camera, margin):
                points[v, u, :] = np.nan


@njit(cache=True)
def move_cylinder(old_points, old_normals, old_labels, X_WE, v_fov, ranges, points, normals, labels):
    """Carries the old points over to the new pose (equation 3)."""
    for v in range(old_points.shape[0]):
        for u in range(old_points.shape[1]):
            x, y, z = old_points[v, u, 0], old_points[v, u, 1], old_points[v, u, 2]
            if x == x:
                n = old_normals[v, u]
                _onto_cylinder(x, y, z, n[0], n[1], n[2], old_labels[v, u], X_WE, v_fov, ranges, points, normals, labels)


@njit(cache=True)
def add_to_cylinder(depth, image_normals, image_labels, camera, stride, X_WE, v_fov, ranges, points, normals, labels):
    """Puts the points of an image onto the cylinder (equations 1 and 2)."""
    R, p, focal = camera
    for v in range(0, depth.shape[0], stride):
        b = (v - focal[3]) / focal[1]
        for u in range(0, depth.shape[1], stride):
            d = depth[v, u]
            if not d < np.inf:
                continue
            a = (u - focal[2]) / focal[0]
            x = p[0] + d * (R[0, 0] * a + R[0, 1] * b + R[0, 2])
            y = p[1] + d * (R[1, 0] * a + R[1, 1] * b + R[1, 2])
            z = p[2] + d * (R[2, 0] * a + R[2, 1] * b + R[2, 2])
            m0, m1, m2 = image_normals[v, u, 0], image_normals[v, u, 1], image_normals[v, u, 2]
            n0 = R[0, 0] * m0 + R[0, 1] * m1 + R[0, 2] * m2
            n1 = R[1, 0] * m0 + R[1, 1] * m1 + R[1, 2] * m2
            n2 = R[2, 0] * m0 + R[2, 1] * m1 + R[2, 2] * m2
            _onto_cylinder(x, y, z, n0, n1, n2, image_labels[v, u], X_WE, v_fov, ranges, points, normals, labels)
