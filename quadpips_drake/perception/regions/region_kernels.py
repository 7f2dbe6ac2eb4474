"""The inner loops of the region extraction: hulls in the plane of a superpixel, carved until they hold only seen ground.

Points that must not be in a region ("void") travel as two arrays, x and y in the plane, so that the compiler can handle
several at once. What counts as void, and what a carved region must be, is said in NumPy by
tests/perception/regions/region_reference.py.
"""

import numpy as np
from numba import njit

from quadpips_drake.math.polygons import (
    area_and_centroid,
    clip_half_plane,
    clipped_area,
    convex_hull,
    distance_inside,
    grow,
    half_planes,
    shrink,
    simplify,
)
from quadpips_drake.perception.superpixels.superpixel_kernels import group_pixels

MAX_VERTICES = 64
"""Room for the vertices of one polygon."""
MIN_UPWARD = 0.3
"""A plane with less of its normal upwards is a wall and no region."""
MAX_CUTS = 40
"""A superpixel that needs more cuts than this is no region."""
CUT_DIRECTIONS = 2
"""Directions that are tried for a cut to either side of the straight one."""
VOID_LOSS = 20.0
"""Area that a void point counts which a cut leaves in the polygon [quarters of a pixel]."""
EDGE_REACH = 8.0
"""Void points within this many half pixels of the one to cut off show the direction of its edge."""


@njit(cache=True, nogil=True)
def plane_frame(normal, x_hint):
    """Returns the rotation (3, 3) whose z axis is ``normal`` and whose x axis is ``x_hint`` brought into the plane."""
    x_axis = x_hint - np.dot(x_hint, normal) * normal
    x_axis /= np.sqrt(np.dot(x_axis, x_axis))
    R = np.empty((3, 3))
    for i in range(3):
        R[i, 0], R[i, 2] = x_axis[i], normal[i]
    R[0, 1] = normal[1] * x_axis[2] - normal[2] * x_axis[1]
    R[1, 1] = normal[2] * x_axis[0] - normal[0] * x_axis[2]
    R[2, 1] = normal[0] * x_axis[1] - normal[1] * x_axis[0]
    return R


@njit(cache=True, nogil=True, inline="always")
def _pixel_on_plane(u, v, middle, rays, center, R):
    """Returns (x, y) where the ray of pixel (u, v) meets the plane through ``center`` spanned by R's x and y axes.

    ``middle`` (u, v) of the cap, ``rays``: EgocanImage.cap_rays.
    """
    du, dv = u - middle[0], v - middle[1]
    a, c = du * rays[1], dv * rays[1]
    x, z = du * rays[0], dv * rays[0]
    along = R[0, 2] * a + R[1, 2] + R[2, 2] * c
    t = (R[0, 2] * (center[0] - x) + R[1, 2] * center[1] + R[2, 2] * (center[2] - z)) / along
    d0, d1, d2 = x + t * a - center[0], t - center[1], z + t * c - center[2]
    return d0 * R[0, 0] + d1 * R[1, 0] + d2 * R[2, 0], d0 * R[0, 1] + d1 * R[1, 1] + d2 * R[2, 1]


@njit(cache=True, nogil=True)
def _pixel_indices(members, columns):
    """Returns (u, v) of flat pixel indices, int64 (n,) each."""
    u, v = np.empty(len(members), np.int64), np.empty(len(members), np.int64)
    for k in range(len(members)):
        row = np.uint32(members[k]) // np.uint32(columns)
        v[k] = row
        u[k] = members[k] - row * columns
    return u, v


@njit(cache=True, nogil=True)
def _extreme_pixels(u, v):
    """Returns the first and last of the pixels (in raster order) of each image row, (n, 2) as (u, v).

    The hull's vertices are among them, because the plane's image keeps lines straight.
    """
    result = np.empty((2 * len(v), 2))
    size = 0
    for k in range(len(v)):
        if k == 0 or v[k - 1] != v[k] or k + 1 == len(v) or v[k + 1] != v[k]:
            result[size, 0], result[size, 1] = u[k], v[k]
            size += 1
    return result[:size]


@njit(cache=True, nogil=True)
def _mark_void(points, ground, normal, offset, max_off_plane, is_void):
    """Writes which of the pixels in a row are void; ``points`` (3 n,). Free of branches, for many pixels at once."""
    n0, n1, n2 = normal
    for k in range(len(is_void)):
        off = n0 * points[3 * k] + n1 * points[3 * k + 1] + n2 * points[3 * k + 2] - offset
        is_void[k] = 1 if (abs(off) > max_off_plane) | (not ground[k]) else 0  # 0 where ground is of unknown height


@njit(cache=True, nogil=True)
def _void_in_box(points, ground, box, center, normal, max_off_plane):
    """Returns which pixels in ``box`` are not ground of this plane, uint8 (rows + 2, columns + 2) with a rim of ones.

    That is what is not in the mask ``ground``, or known (not NaN) and further off the plane than ``max_off_plane``.
    """
    u0, u1, v0, v1 = box
    is_void = np.ones((v1 - v0 + 3, u1 - u0 + 3), np.uint8)
    n0, n1, n2 = normal
    offset = n0 * center[0] + n1 * center[1] + n2 * center[2]
    first, last = max(u0, 0), min(u1 + 1, ground.shape[1])
    for v in range(max(v0, 0), min(v1 + 1, ground.shape[0])):
        row = is_void[v - v0 + 1, first - u0 + 1 : last - u0 + 1]
        _mark_void(points[v].reshape(-1)[3 * first :], ground[v, first:last], (n0, n1, n2), offset, max_off_plane, row)
    return is_void


@njit(cache=True, nogil=True)
def _find_void(is_void, box, middle, rays, center, R, polygon):
    """Returns the plane coordinates x (n,), y (n,) of the void pixels of ``box`` that lie in ``polygon``.

    Only those next to ground are listed: nothing convex around a piece of ground reaches the others past them.
    """
    x, y = np.empty(is_void.size), np.empty(is_void.size)
    lines = half_planes(polygon)
    size = 0
    for i in range(1, is_void.shape[0] - 1):
        for j in range(1, is_void.shape[1] - 1):
            if not is_void[i, j]:
                continue
            around = 0
            for a in range(i - 1, i + 2):
                around += is_void[a, j - 1] + is_void[a, j] + is_void[a, j + 1]
            if around == 9:
                continue
            px, py = _pixel_on_plane(j + box[0] - 1, i + box[2] - 1, middle, rays, center, R)
            inside = True
            for k in range(len(lines)):
                inside = inside and lines[k, 0] * px + lines[k, 1] * py < lines[k, 2]
            if inside:
                x[size], y[size] = px, py
                size += 1
    return x[:size].copy(), y[:size].copy()


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "reassoc", "contract"})
def _nearest(void_x, void_y, x, y):
    """Returns the squared distance of (x, y) from the nearest void point."""
    nearest = 1e30
    for k in range(len(void_x)):
        dx, dy = void_x[k] - x, void_y[k] - y
        nearest = min(nearest, dx * dx + dy * dy)
    return nearest


@njit(cache=True, nogil=True)
def _roomiest_pixel(u, v, is_void, box, void_x, void_y, middle, rays, center, R):
    """Returns (x, y, distance) of the pixel that is furthest from all void, not void itself; -1 if there is none.

    Of many pixels, every second or third in either direction is tried.
    """
    best, best_x, best_y = -1.0, 0.0, 0.0
    every = 1 if len(u) < 60 else (2 if len(u) < 200 else 3)
    for k in range(len(u)):
        if (every > 1 and (u[k] % every or v[k] % every)) or is_void[v[k] - box[2] + 1, u[k] - box[0] + 1]:
            continue
        x, y = _pixel_on_plane(u[k], v[k], middle, rays, center, R)
        nearest = _nearest(void_x, void_y, x, y)
        if nearest > best:
            best, best_x, best_y = nearest, x, y
    return best_x, best_y, np.sqrt(best) if best >= 0 else -1.0


@njit(cache=True, nogil=True)
def _edge_through(void_x, void_y, index, x, y, pull):
    """Returns (nx, ny, offset) of the half plane that cuts off the edge at void point ``index`` in one piece.

    The edge is the line of least squares through the void points nearby; all of them are cut off.
    """
    reach = (EDGE_REACH * pull) ** 2
    n, sx, sy, sxx, sxy, syy = 0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(void_x)):
        dx, dy = void_x[k] - void_x[index], void_y[k] - void_y[index]
        if dx * dx + dy * dy <= reach:
            n, sx, sy = n + 1, sx + dx, sy + dy
            sxx, sxy, syy = sxx + dx * dx, sxy + dx * dy, syy + dy * dy
    sxx, sxy, syy = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
    angle = 0.5 * np.arctan2(2.0 * sxy, sxx - syy)  # of the line
    nx, ny = -np.sin(angle), np.cos(angle)
    if nx * (void_x[index] - x) + ny * (void_y[index] - y) < 0:
        nx, ny = -nx, -ny
    least = np.inf
    for k in range(len(void_x)):
        dx, dy = void_x[k] - void_x[index], void_y[k] - void_y[index]
        if dx * dx + dy * dy <= reach:
            least = min(least, nx * void_x[k] + ny * void_y[k])
    return nx, ny, least - pull


@njit(cache=True, nogil=True)
def _best_cut(polygon, void_x, void_y, index, x, y, pull, room, loss):
    """Returns (nx, ny, offset) of the half plane that cuts off void point ``index`` and leaves most of ``polygon``.

    Tried are the edge there and directions up to 60 deg to either side of the one from (x, y) to the point, as far as they
    leave ``room`` [m] around (x, y). Void that is left inside will cost more cuts, so each such point counts as a ``loss``
    of area [m^2].
    """
    dx, dy = void_x[index] - x, void_y[index] - y
    length = np.sqrt(dx * dx + dy * dy)
    best = (dx / length, dy / length, length - pull + (dx * x + dy * y) / length)
    best_value = -np.inf
    for k in range(-CUT_DIRECTIONS, CUT_DIRECTIONS + 2):
        if k > CUT_DIRECTIONS:
            nx, ny, offset = _edge_through(void_x, void_y, index, x, y, pull)
        else:
            angle = k * np.pi / 3.0 / CUT_DIRECTIONS
            c, s = np.cos(angle), np.sin(angle)
            nx, ny = (c * dx - s * dy) / length, (s * dx + c * dy) / length
            offset = nx * void_x[index] + ny * void_y[index] - pull
        if k != 0 and offset - nx * x - ny * y < room:
            continue
        remaining = 0
        for i in range(len(void_x)):
            remaining += nx * void_x[i] + ny * void_y[i] < offset
        value = clipped_area(polygon, nx, ny, offset) - remaining * loss
        if value > best_value:
            best_value, best = value, (nx, ny, offset)
    return best


@njit(cache=True, nogil=True)
def _keep_inside(void_x, void_y, nx, ny, offset):
    """Returns the void points with nx x + ny y < offset; the arrays are overwritten."""
    size = 0
    for k in range(len(void_x)):
        if nx * void_x[k] + ny * void_y[k] < offset:
            void_x[size], void_y[size] = void_x[k], void_y[k]
            size += 1
    return void_x[:size], void_y[:size]


@njit(cache=True, nogil=True)
def _carve(polygon, void_x, void_y, x, y, pull, room):
    """Returns the part of ``polygon`` around (x, y) without any void point, each cut ``pull`` before the point."""
    for line in half_planes(polygon):
        void_x, void_y = _keep_inside(void_x, void_y, line[0], line[1], line[2] + pull)
    for cut in range(MAX_CUTS):
        if len(void_x) == 0:
            return polygon
        index = 0
        nearest = np.inf
        for k in range(len(void_x)):
            distance = (void_x[k] - x) ** 2 + (void_y[k] - y) ** 2
            if distance < nearest:
                nearest, index = distance, k
        if nearest <= pull * pull:
            break
        loss = VOID_LOSS * (1.0 + cut / 8.0) * pull * pull  # towards the end, few large cuts rather than many small ones
        nx, ny, offset = _best_cut(polygon, void_x, void_y, index, x, y, pull, room, loss)
        polygon = clip_half_plane(polygon, nx, ny, offset)
        if len(polygon) == 0:
            break
        void_x, void_y = _keep_inside(void_x, void_y, nx, ny, offset)
    return np.empty((0, 2))


@njit(cache=True, nogil=True)
def carve_regions(
    assignment, points, ground, centers, normals, rays, clearance, overlap, min_radius, max_off_plane, max_vertices, x_hint
):
    """Returns (frames X_ER (k, 4, 4), boundaries (k, MAX_VERTICES, 2), their sizes, insets, their sizes, clusters (k,))."""
    middle = (assignment.shape[1] // 2, assignment.shape[0] // 2)
    n = len(centers)
    frames = np.zeros((n, 4, 4))
    boundaries, insets = np.zeros((n, MAX_VERTICES, 2)), np.zeros((n, MAX_VERTICES, 2))
    boundary_sizes, inset_sizes = np.zeros(n, np.int64), np.zeros(n, np.int64)
    clusters = np.zeros(n, np.int64)
    first, pixels = group_pixels(assignment, n, np.arange(assignment.size))
    count = 0
    for c in range(n):
        if not (-normals[c, 1] > MIN_UPWARD and np.isfinite(centers[c]).all()):  # False for NaN, too
            continue
        center = centers[c].copy()
        R = plane_frame(normals[c].copy(), x_hint)
        members = pixels[first[c] : first[c + 1]]
        boundary, inset = _carve_one(
            members, points, ground, center, R, middle, rays, clearance, overlap, min_radius, max_off_plane, max_vertices
        )
        area, x, y = area_and_centroid(inset)
        if area <= 0 or distance_inside(inset, x, y) < min_radius:
            continue
        for i in range(3):
            for j in range(3):
                frames[count, i, j] = R[i, j]
            frames[count, i, 3] = center[i] + R[i, 0] * x + R[i, 1] * y
        frames[count, 3, 3] = 1.0
        boundary_sizes[count], inset_sizes[count] = min(len(boundary), MAX_VERTICES), len(inset)
        for k in range(boundary_sizes[count]):
            boundaries[count, k, 0], boundaries[count, k, 1] = boundary[k, 0] - x, boundary[k, 1] - y
        for k in range(len(inset)):
            insets[count, k, 0], insets[count, k, 1] = inset[k, 0] - x, inset[k, 1] - y
        clusters[count] = c
        count += 1
    return (
        frames[:count], boundaries[:count], boundary_sizes[:count], insets[:count], inset_sizes[:count], clusters[:count]
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _carve_one(
    members, points, ground, center, R, middle, rays, clearance, overlap, min_radius, max_off_plane, max_vertices
):
    """Returns (boundary, inset) of one superpixel in the plane (center, R); empty when there is no room for a foot."""
    nothing = np.empty((0, 2))
    u, v = _pixel_indices(members, ground.shape[1])
    corners = _extreme_pixels(u, v)
    on_plane = np.empty((len(corners), 2))
    for k in range(len(corners)):
        on_plane[k] = _pixel_on_plane(corners[k, 0], corners[k, 1], middle, rays, center, R)
    hull = convex_hull(on_plane)
    if len(hull) == 0:  # so for NaN, too
        return nothing, nothing
    pixel = rays[0] + rays[1] * center[1]
    reach = int(np.ceil(1.5 * (clearance + overlap) / pixel)) + 1
    box = (u.min() - reach, u.max() + reach, v.min() - reach, v.max() + reach)
    is_void = _void_in_box(points, ground, box, center, R[:, 2], max_off_plane)
    void_x, void_y = _find_void(is_void, box, middle, rays, center, R, grow(hull, clearance + overlap + pixel))
    boundary = grow(hull, clearance + overlap)
    x, y, room = _roomiest_pixel(u, v, is_void, box, void_x, void_y, middle, rays, center, R)
    if room - 0.5 * pixel < clearance + min_radius:
        return nothing, nothing
    if len(void_x) > 0:
        boundary = _carve(boundary, void_x, void_y, x, y, 0.5 * pixel, clearance + min_radius)
        if len(boundary) == 0:
            return nothing, nothing
    boundary = simplify(boundary, max_vertices)
    return boundary, shrink(boundary, clearance)
