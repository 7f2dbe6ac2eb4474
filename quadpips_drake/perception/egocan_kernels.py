"""The inner loops of the egocan. Camera arguments are packed as (R_WC (3, 3), p_WC (3,), (fx, fy, cx, cy))."""

import numpy as np
from numba import njit

MAX_SUBDIVISION = 6
"""Most pieces into which the surface between two vertically neighbouring pixels is cut."""
WALL = 0.6
"""Points whose normals point upward by less than this are taken for a wall when they meet ground in one cell."""


def pack_camera(X_WC, intrinsics):
    """Returns the camera in the form that the kernels take."""
    focal = np.array([intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy])
    return np.ascontiguousarray(X_WC[:3, :3]), np.ascontiguousarray(X_WC[:3, 3]), focal


@njit(cache=True, inline="always")
def _add_ground(x, y, z, nx, ny, nz, up, label, layer, total, labels):
    """Adds one point (x, y in cells) to the totals [count, height, normal (3), upward part of the normal] of its cell.

    A higher layer displaces a lower one. Within a layer, points that face upward displace those of a wall: the wall below an
    edge does not tilt the edge.
    """
    if not (0 <= x < total.shape[0] and 0 <= y < total.shape[1]):
        return
    i, j = int(x), int(y)
    n = total[i, j, 0]
    if n > 0:
        above = z - total[i, j, 1] / n
        if above < -layer:
            return
        faces_up, is_floor = up > WALL, total[i, j, 5] > WALL * n
        if above <= layer and is_floor and not faces_up:
            return
        if above <= layer and is_floor == faces_up:
            total[i, j, 5] += up
            total[i, j, 0] = n + 1
            total[i, j, 1] += z
            total[i, j, 2] += nx
            total[i, j, 3] += ny
            total[i, j, 4] += nz
            labels[i, j] = max(label, labels[i, j])
            return
    total[i, j, 0] = 1
    total[i, j, 1] = z
    total[i, j, 2] = nx
    total[i, j, 3] = ny
    total[i, j, 4] = nz
    total[i, j, 5] = up
    labels[i, j] = label


@njit(cache=True, fastmath={"contract", "arcp"})
def collect_ground(depth, normals, image_labels, camera, first_cell, cell_size, layer, total, labels):
    """Sums the points of an image per cell; points without a normal (edges, noise) are left out.

    ``total`` (n, n, 6): count, height above the camera, normal in C, its upward component. Close to the camera every second
    column and row is enough. Rows of pixels far ahead lie further apart on the ground than a cell. The sensor sees one
    unbroken surface between two neighbouring pixels, so the piece between them is added as well, as long as it is as flat as
    their normals say.
    """
    R, p, focal = camera
    fx, fy, cx, cy = np.float32(focal[0]), np.float32(focal[1]), np.float32(focal[2]), np.float32(focal[3])
    rows, columns = depth.shape
    per_cell = 1.0 / cell_size
    x0, y0 = np.float32(p[0] * per_cell - first_cell[0]), np.float32(p[1] * per_cell - first_cell[1])
    r = (R * np.array([[per_cell], [per_cell], [1.0]])).astype(np.float32)  # x and y in cells from here on
    up0, up1, up2 = r[2, 0], r[2, 1], r[2, 2]
    dense = np.float32(0.35 * cell_size * focal[0])
    flat = np.float32(0.5 * cell_size)
    above, known = np.zeros((columns, 3), np.float32), np.zeros(columns, np.bool_)  # the pixel above, in C
    for v in range(rows):
        b = (np.float32(v) - cy) / fy
        bx, by, bz = r[0, 1] * b + r[0, 2], r[1, 1] * b + r[1, 2], r[2, 1] * b + r[2, 2]
        for u in range(columns):
            z = depth[v, u]
            n0, n1, n2 = normals[v, u, 0], normals[v, u, 1], normals[v, u, 2]
            a = (np.float32(u) - cx) / fx
            height = z * (r[2, 0] * a + bz)
            # invalid, above the camera, or one too many
            spare = (z < dense and u % 2 == 1) or (z < 0.6 * dense and v % 2 == 1)
            if spare or height >= 0 or not (z < np.inf and n0 == n0):
                known[u] = False
                continue
            x, y = z * (r[0, 0] * a + bx), z * (r[1, 0] * a + by)
            label = image_labels[v, u]
            up = up0 * n0 + up1 * n1 + up2 * n2
            _add_ground(x0 + x, y0 + y, height, n0, n1, n2, up, label, layer, total, labels)
            if known[u]:
                e0, e1, e2 = above[u, 0] - z * a, above[u, 1] - z * b, above[u, 2] - z
                ex, ey = r[0, 0] * e0 + r[0, 1] * e1 + r[0, 2] * e2, r[1, 0] * e0 + r[1, 1] * e1 + r[1, 2] * e2
                pieces = int(max(abs(ex), abs(ey)) * 1.5) + 1
                if 1 < pieces <= MAX_SUBDIVISION and abs(n0 * e0 + n1 * e1 + n2 * e2) < flat:
                    ez = r[2, 0] * e0 + r[2, 1] * e1 + r[2, 2] * e2
                    for k in range(1, pieces):
                        t = np.float32(k) / np.float32(pieces)
                        _add_ground(
                            x0 + x + t * ex, y0 + y + t * ey, height + t * ez, n0, n1, n2, up, label, layer, total, labels
                        )
            above[u, 0], above[u, 1], above[u, 2] = z * a, z * b, z
            known[u] = True


@njit(cache=True)
def sees_through(x, y, z, depth, camera, margin):
    """Whether the image shows something clearly behind the point (x, y, z) of W, in all four pixels around it.

    Depth +inf says "nothing in range" and so is behind; NaN says nothing at all.
    """
    R, p, focal = camera
    dx, dy, dz = x - p[0], y - p[1], z - p[2]
    z_C = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz
    if z_C < 0.05:
        return False
    u = focal[0] * (R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz) / z_C + focal[2]
    v = focal[1] * (R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz) / z_C + focal[3]
    if not (0 <= u < depth.shape[1] - 1 and 0 <= v < depth.shape[0] - 1):
        return False
    i, j = int(v), int(u)
    limit = z_C + margin
    return depth[i, j] > limit and depth[i, j + 1] > limit and depth[i + 1, j] > limit and depth[i + 1, j + 1] > limit


@njit(cache=True)
def merge_ground(
    total, new_label, blend_height, max_count, depth, camera, first_cell, cell_size, margin, height, normal, label, count
):
    """Writes the sums of one image into the memory, cell by cell, and forgets what the image disproves.

    Ground seen below a measured surface (a view under a slab, from the side) does not disprove it: a lower surface takes the
    cell only when the camera also sees through the old one.
    """
    R = camera[0]
    for i in range(height.shape[0]):
        for j in range(height.shape[1]):
            n = total[i, j, 0]
            if n == 0:
                if np.isfinite(height[i, j]):
                    x = (first_cell[0] + i + 0.5) * cell_size
                    y = (first_cell[1] + j + 0.5) * cell_size
                    if sees_through(x, y, height[i, j], depth, camera, margin):
                        height[i, j] = np.nan
                        normal[i, j, :] = np.nan
                        label[i, j] = 0
                        count[i, j] = 0
                continue
            z = camera[1][2] + total[i, j, 1] / n
            if count[i, j] > 0 and z < height[i, j] - blend_height:
                x = (first_cell[0] + i + 0.5) * cell_size
                y = (first_cell[1] + j + 0.5) * cell_size
                if not sees_through(x, y, height[i, j], depth, camera, margin):
                    continue
            n0, n1, n2 = total[i, j, 2], total[i, j, 3], total[i, j, 4]
            length = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
            if length == 0:
                continue
            share = 1.0
            if count[i, j] > 0 and abs(z - height[i, j]) <= blend_height:
                share = 1.0 / (count[i, j] + 1.0)
            else:
                count[i, j] = 0
            height[i, j] = z if share == 1.0 else height[i, j] + share * (z - height[i, j])
            norm = 0.0
            for k in range(3):
                value = (R[k, 0] * n0 + R[k, 1] * n1 + R[k, 2] * n2) / length
                normal[i, j, k] = value if share == 1.0 else normal[i, j, k] + share * (value - normal[i, j, k])
                norm += normal[i, j, k] ** 2
            if norm > 0:
                for k in range(3):
                    normal[i, j, k] /= np.sqrt(norm)
            label[i, j] = new_label[i, j]
            count[i, j] = min(count[i, j] + 1, max_count)


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
def move_cylinder(old_points, old_normals, old_labels, depth, camera, margin, X_WE, v_fov, ranges, points, normals, labels):
    """Carries the old points over to the new pose (equation 3), except those that the camera now sees through."""
    for v in range(old_points.shape[0]):
        for u in range(old_points.shape[1]):
            x, y, z = old_points[v, u, 0], old_points[v, u, 1], old_points[v, u, 2]
            if x == x and not sees_through(x, y, z, depth, camera, margin):
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
