"""The inner loops of the region extraction: hulls in the plane of a superpixel, carved until they hold only seen ground."""

import numpy as np
from numba import njit

from quadpips_drake.perception.polygons import (
    area_and_centroid,
    clip_half_plane,
    convex_hull,
    distance_inside,
    grow,
    shrink,
    simplify,
)
from quadpips_drake.perception.superpixel_kernels import group_pixels

MAX_VERTICES = 64
"""Room for the vertices of one polygon."""
MAX_CUTS = 40
"""A superpixel that needs more cuts than this is no region."""
CUT_DIRECTIONS = 2
"""Directions that are tried for a cut to either side of the straight one."""


@njit(cache=True)
def plane_frame(normal, x_hint):
    """Returns the rotation (3, 3) whose z axis is ``normal`` and whose x axis is ``x_hint`` brought into the plane."""
    x_axis = x_hint - np.dot(x_hint, normal) * normal
    x_axis /= np.sqrt(np.dot(x_axis, x_axis))
    R = np.empty((3, 3))
    R[:, 0] = x_axis
    R[0, 1] = normal[1] * x_axis[2] - normal[2] * x_axis[1]
    R[1, 1] = normal[2] * x_axis[0] - normal[0] * x_axis[2]
    R[2, 1] = normal[0] * x_axis[1] - normal[1] * x_axis[0]
    R[:, 2] = normal
    return R


@njit(cache=True, inline="always")
def _pixel_on_plane(u, v, middle, rays, center, R):
    """Returns (x, y) where the ray of pixel (u, v) meets the plane through ``center`` spanned by R's x and y axes."""
    a, c = (u - middle) * rays[1], (v - middle) * rays[1]
    x, z = (u - middle) * rays[0], (v - middle) * rays[0]
    along = R[0, 2] * a + R[1, 2] + R[2, 2] * c
    t = (R[0, 2] * (center[0] - x) + R[1, 2] * center[1] + R[2, 2] * (center[2] - z)) / along
    d0, d1, d2 = x + t * a - center[0], t - center[1], z + t * c - center[2]
    return d0 * R[0, 0] + d1 * R[1, 0] + d2 * R[2, 0], d0 * R[0, 1] + d1 * R[1, 1] + d2 * R[2, 1]


@njit(cache=True)
def _extreme_pixels(members, columns):
    """Returns the first and last pixel of each image row in ``members`` (ascending), (n, 2) as (u, v): the hull's vertices
    are among them, because the plane's image keeps lines straight."""
    result = np.empty((2 * len(members), 2))
    size = 0
    for k in range(len(members)):
        row = members[k] // columns
        starts = k == 0 or members[k - 1] // columns != row
        ends = k + 1 == len(members) or members[k + 1] // columns != row
        if starts or ends:
            result[size, 0], result[size, 1] = members[k] % columns, row
            size += 1
    return result[:size]


@njit(cache=True, inline="always")
def _borders_ground(is_void, i, j):
    """Whether any of the pixels around (i, j) is not void."""
    for a in range(max(i - 1, 0), min(i + 2, is_void.shape[0])):
        for b in range(max(j - 1, 0), min(j + 2, is_void.shape[1])):
            if not is_void[a, b]:
                return True
    return False


@njit(cache=True)
def _find_void(points, ground, box, middle, rays, center, R, max_off_plane, polygon):
    """Returns the plane coordinates (n, 2) of pixels in ``box`` and ``polygon`` that are not ground of this plane.

    That is what is not in the mask ``ground``, or known (not NaN) and further off the plane than ``max_off_plane``. Only
    those next to ground are listed: nothing convex around a piece of ground reaches the others past them.
    """
    u0, u1, v0, v1 = box
    is_void = np.zeros((v1 - v0 + 1, u1 - u0 + 1), np.bool_)
    for v in range(v0, v1 + 1):
        for u in range(u0, u1 + 1):
            inside = 0 <= v < ground.shape[0] and 0 <= u < ground.shape[1]
            if inside and ground[v, u]:
                off = 0.0
                for k in range(3):
                    off += (points[v, u, k] - center[k]) * R[k, 2]
                is_void[v - v0, u - u0] = abs(off) > max_off_plane  # False where unknown
            else:
                is_void[v - v0, u - u0] = True
    void = np.empty((is_void.size, 2))
    size = 0
    for i in range(is_void.shape[0]):
        for j in range(is_void.shape[1]):
            if is_void[i, j] and _borders_ground(is_void, i, j):
                x, y = _pixel_on_plane(j + u0, i + v0, middle, rays, center, R)
                if distance_inside(polygon, x, y) > 0:
                    void[size, 0], void[size, 1] = x, y
                    size += 1
    return void[:size]


@njit(cache=True)
def _roomiest_pixel(members, columns, void, middle, rays, center, R):
    """Returns (x, y, distance) of the member pixel that is furthest from all of ``void``; of many pixels, every second or
    third in either direction is tried."""
    best, best_x, best_y = -1.0, 0.0, 0.0
    every = 1 if len(members) < 60 else (2 if len(members) < 200 else 3)
    for i in members:
        u, v = i % columns, i // columns
        if u % every or v % every:
            continue
        x, y = _pixel_on_plane(u, v, middle, rays, center, R)
        nearest = np.inf
        for k in range(len(void)):
            nearest = min(nearest, (void[k, 0] - x) ** 2 + (void[k, 1] - y) ** 2)
            if nearest <= best:
                break
        if nearest > best:
            best, best_x, best_y = nearest, x, y
    return best_x, best_y, np.sqrt(max(best, 0.0))


@njit(cache=True)
def _best_cut(polygon, void, left, index, x, y, pull, room):
    """Returns (nx, ny, offset) of the half plane that cuts off void point ``index`` and leaves most of ``polygon``.

    Directions up to 60 deg to either side of the one from (x, y) to the point are tried, as far as they leave ``room`` [m]
    around (x, y). Void that is left inside will cost more cuts, so each such point counts as a loss.
    """
    dx, dy = void[index, 0] - x, void[index, 1] - y
    length = np.sqrt(dx * dx + dy * dy)
    best, best_x, best_y = -np.inf, dx / length, dy / length
    for k in range(-CUT_DIRECTIONS, CUT_DIRECTIONS + 1):
        angle = k * np.pi / 3.0 / CUT_DIRECTIONS
        if length * np.cos(angle) - pull < room and k != 0:
            continue
        c, s = np.cos(angle), np.sin(angle)
        nx, ny = (c * dx - s * dy) / length, (s * dx + c * dy) / length
        offset = nx * void[index, 0] + ny * void[index, 1] - pull
        remaining = 0
        for i in range(len(void)):
            if left[i] and nx * void[i, 0] + ny * void[i, 1] < offset:
                remaining += 1
        value = area_and_centroid(clip_half_plane(polygon, nx, ny, offset))[0] - remaining * 8.0 * pull * pull
        if value > best:
            best, best_x, best_y = value, nx, ny
    return best_x, best_y, best_x * void[index, 0] + best_y * void[index, 1] - pull


@njit(cache=True)
def _carve(polygon, void, x, y, pull, room):
    """Returns the part of ``polygon`` around (x, y) without any point of ``void``, each cut ``pull`` before the point."""
    left = np.empty(len(void), np.bool_)
    for k in range(len(void)):
        left[k] = distance_inside(polygon, void[k, 0], void[k, 1]) > -pull
    for _ in range(MAX_CUTS):
        nearest, index = np.inf, -1
        for k in range(len(void)):
            if left[k]:
                distance = (void[k, 0] - x) ** 2 + (void[k, 1] - y) ** 2
                if distance < nearest:
                    nearest, index = distance, k
        if index < 0:
            return polygon
        if nearest <= pull * pull:
            break
        nx, ny, offset = _best_cut(polygon, void, left, index, x, y, pull, room)
        polygon = clip_half_plane(polygon, nx, ny, offset)
        if len(polygon) == 0:
            break
        for k in range(len(void)):
            left[k] = left[k] and nx * void[k, 0] + ny * void[k, 1] < offset
    return np.empty((0, 2))


@njit(cache=True)
def carve_regions(
    assignment, points, ground, centers, normals, rays, clearance, overlap, min_radius, max_off_plane, max_vertices, x_hint
):
    """Returns (frames X_ER (k, 4, 4), boundaries (k, MAX_VERTICES, 2), their sizes, insets, their sizes, clusters (k,))."""
    columns = assignment.shape[1]
    middle = columns // 2
    n = len(centers)
    frames = np.zeros((n, 4, 4))
    boundaries, insets = np.zeros((n, MAX_VERTICES, 2)), np.zeros((n, MAX_VERTICES, 2))
    boundary_sizes, inset_sizes = np.zeros(n, np.int64), np.zeros(n, np.int64)
    clusters = np.zeros(n, np.int64)
    first, pixels = group_pixels(assignment, n)
    count = 0
    for c in range(n):
        if not np.isfinite(normals[c, 0]):
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
        frames[count, :3, :3] = R
        frames[count, :3, 3] = center + R[:, 0] * x + R[:, 1] * y
        frames[count, 3, 3] = 1.0
        boundary_sizes[count], inset_sizes[count] = min(len(boundary), MAX_VERTICES), len(inset)
        shift = np.array([x, y])
        boundaries[count, : boundary_sizes[count]] = boundary[:MAX_VERTICES] - shift
        insets[count, : len(inset)] = inset - shift
        clusters[count] = c
        count += 1
    return (
        frames[:count], boundaries[:count], boundary_sizes[:count], insets[:count], inset_sizes[:count], clusters[:count]
    )  # fmt: skip


@njit(cache=True)
def _carve_one(
    members, points, ground, center, R, middle, rays, clearance, overlap, min_radius, max_off_plane, max_vertices
):
    """Returns (boundary, inset) of one superpixel in the plane (center, R); empty when there is no room for a foot."""
    columns = ground.shape[1]
    nothing = np.empty((0, 2))
    corners = _extreme_pixels(members, columns)
    on_plane = np.empty((len(corners), 2))
    for k in range(len(corners)):
        on_plane[k] = _pixel_on_plane(corners[k, 0], corners[k, 1], middle, rays, center, R)
    hull = convex_hull(on_plane)
    if len(hull) == 0:
        return nothing, nothing
    pixel = rays[0] + rays[1] * center[1]
    reach = int(np.ceil(1.5 * (clearance + overlap) / pixel)) + 1
    box = (
        int(corners[:, 0].min()) - reach,
        int(corners[:, 0].max()) + reach,
        int(corners[:, 1].min()) - reach,
        int(corners[:, 1].max()) + reach,
    )
    void = _find_void(points, ground, box, middle, rays, center, R, max_off_plane, grow(hull, clearance + overlap + pixel))
    boundary = grow(hull, clearance + overlap)
    if len(void) > 0:
        x, y, room = _roomiest_pixel(members, columns, void, middle, rays, center, R)
        if room - 0.5 * pixel < clearance + min_radius:
            return nothing, nothing
        boundary = _carve(boundary, void, x, y, 0.5 * pixel, clearance + min_radius)
        if len(boundary) == 0:
            return nothing, nothing
    boundary = simplify(boundary, max_vertices)
    return boundary, shrink(boundary, clearance)
