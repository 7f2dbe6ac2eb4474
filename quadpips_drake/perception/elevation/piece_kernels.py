"""The inner loops of the plane decomposition: from where a foot's centre may go on a plane to convex pieces of it."""

import numpy as np
from numba import njit

from quadpips_drake.math.polygons import area_and_centroid, convex_hull, distance_inside, grow, simplify
from quadpips_drake.perception.regions.region_kernels import plane_frame

MAX_VERTICES = 64
"""Room for the vertices of one polygon."""
_MAX_PIECES = 1024
"""Most pieces of one plane."""
_LEAST_SIDE = 3
"""A window narrower than this is not cut further [pixels]."""


@njit(cache=True, nogil=True)
def cuts_along(low, high, first, piece):
    """Returns where pixels low..high (inclusive) of an axis are cut, first pixels of the parts and the end, int64 (k + 1,).

    Cuts lie at multiples of ``piece`` in the world, so that they stay where they are while the map travels; ``first``: world
    index of pixel 0. None is so near an end that a narrow strip would remain.
    """
    cuts = np.empty((high - low) // piece + 3, np.int64)
    cuts[0] = low
    size, narrow = 1, 2 * piece // 5
    at = -((first + low) % piece) + low
    while at <= high:
        if at - low >= narrow and high - at >= narrow:
            cuts[size] = at
            size += 1
        at += piece
    cuts[size] = high + 1
    return cuts[: size + 1]


@njit(cache=True, nogil=True)
def _hull_in(room, window):
    """Returns the convex hull (n, 2) of the pixels of ``room`` in the ``window`` (first and past-the-last row, column)."""
    top, bottom, left, right = window
    points = np.empty((2 * (bottom - top), 2))
    size = 0
    for i in range(top, bottom):
        first = last = -1
        for j in range(left, right):
            if room[i, j]:
                first = j if first < 0 else first
                last = j
        if first >= 0:
            points[size, 0], points[size, 1] = i, first
            points[size + 1, 0], points[size + 1, 1] = i, last
            size += 2
    return convex_hull(points[:size].copy())


@njit(cache=True, nogil=True)
def _holds_only(polygon, free, window):
    """Whether all pixels inside the ``polygon`` are ``free``."""
    top, bottom, left, right = window
    for i in range(top, bottom):
        low, high = np.inf, -np.inf  # columns of the polygon in this row
        for k in range(len(polygon)):
            p, q = polygon[k], polygon[(k + 1) % len(polygon)]
            if min(p[0], q[0]) <= i <= max(p[0], q[0]):
                part = (i - p[0]) / (q[0] - p[0]) if q[0] != p[0] else 0.0
                at = p[1] + part * (q[1] - p[1])
                low, high = min(low, at), max(high, at)
                if q[0] == p[0]:
                    low, high = min(low, q[1]), max(high, q[1])
        if low > high:
            continue
        for j in range(max(int(np.ceil(low + 1e-6)), left), min(int(np.floor(high - 1e-6)) + 1, right)):
            if not free[i, j]:
                return False
    return True


@njit(cache=True, nogil=True)
def convex_pieces(room, free, box, first, piece, overlap):
    """Returns (polygons (k, MAX_VERTICES, 2) in pixels, sizes (k,)): convex pieces of ``room`` in ``box``.

    The box is cut into windows of about ``piece`` pixels. Where the hull of a window's room holds a pixel that is not
    ``free``, the window is quartered.

    Args:
        room: where a foot's centre may go, bool (h, w).
        free: where it may go if need be, bool (h, w).
        box: first and past-the-last row and column of a connected part of the room.
        first: world indices of pixel (0, 0), (2,).
        piece, overlap: wanted side, and by how much windows overlap [pixels].
    """
    polygons, sizes = np.zeros((_MAX_PIECES, MAX_VERTICES, 2)), np.zeros(_MAX_PIECES, np.int64)
    count = 0
    rows = cuts_along(box[0], box[1] - 1, first[0], piece)
    columns = cuts_along(box[2], box[3] - 1, first[1], piece)
    stack = np.empty((4 * _MAX_PIECES, 4), np.int64)
    size = 0
    for a in range(len(rows) - 1):
        for b in range(len(columns) - 1):
            if size < _MAX_PIECES:
                stack[size] = (rows[a], rows[a + 1], columns[b], columns[b + 1])
                size += 1
    while size > 0 and count < _MAX_PIECES:
        size -= 1
        r0, r1, c0, c1 = stack[size]
        window = (max(r0 - overlap, box[0]), min(r1 + overlap, box[1]), max(c0 - overlap, box[2]), min(c1 + overlap, box[3]))
        hull = _hull_in(room, window)
        if len(hull) == 0:
            continue
        if _holds_only(hull, free, window):
            hull = simplify(hull, MAX_VERTICES)
            sizes[count] = len(hull)
            for k in range(len(hull)):
                polygons[count, k, 0], polygons[count, k, 1] = hull[k, 0], hull[k, 1]
            count += 1
            continue
        rm, cm = (r0 + r1) // 2, (c0 + c1) // 2
        if min(r1 - r0, c1 - c0) <= _LEAST_SIDE or size + 4 > len(stack):
            continue
        stack[size], stack[size + 1] = (r0, rm, c0, cm), (r0, rm, cm, c1)
        stack[size + 2], stack[size + 3] = (rm, r1, c0, cm), (rm, r1, cm, c1)
        size += 4
    return polygons[:count], sizes[:count]


@njit(cache=True, nogil=True)
def place_pieces(polygons, sizes, corner, pixel, plane, clearance, min_radius, max_vertices):
    """Returns (frames X_WR (k, 4, 4), boundaries (k, MAX_VERTICES, 2), their sizes, insets, their sizes) of the pieces with
    room for a foot.

    Args:
        polygons, sizes: from ``convex_pieces``.
        corner: x, y of the corner of pixel (0, 0) [m].
        pixel: side of a pixel [m].
        plane: (a, b, c) with z = a x + b y + c in W.
        clearance: distance between inset and boundary [m].
        min_radius, max_vertices: of an inset.
    """
    n = len(polygons)
    frames = np.zeros((n, 4, 4))
    boundaries, insets = np.zeros((n, MAX_VERTICES, 2)), np.zeros((n, MAX_VERTICES, 2))
    boundary_sizes, inset_sizes = np.zeros(n, np.int64), np.zeros(n, np.int64)
    normal = np.array([-plane[0], -plane[1], 1.0])
    normal /= np.sqrt(np.dot(normal, normal))
    R = plane_frame(normal, np.array([1.0, 0.0, 0.0]))
    count = 0
    for p in range(n):
        size = sizes[p]
        x0 = corner[0] + (polygons[p, 0, 0] + 0.5) * pixel
        y0 = corner[1] + (polygons[p, 0, 1] + 0.5) * pixel
        z0 = plane[0] * x0 + plane[1] * y0 + plane[2]
        flat = np.empty((size, 2))
        for k in range(size):
            dx = (polygons[p, k, 0] - polygons[p, 0, 0]) * pixel
            dy = (polygons[p, k, 1] - polygons[p, 0, 1]) * pixel
            dz = plane[0] * dx + plane[1] * dy
            flat[k, 0] = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz
            flat[k, 1] = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz
        inset = simplify(flat, max_vertices)
        area, x, y = area_and_centroid(inset)
        if area <= 0 or distance_inside(inset, x, y) < min_radius:
            continue
        inset[:, 0] -= x
        inset[:, 1] -= y
        boundary = grow(inset, clearance)
        frames[count, :3, :3] = R
        frames[count, 0, 3] = x0 + R[0, 0] * x + R[0, 1] * y
        frames[count, 1, 3] = y0 + R[1, 0] * x + R[1, 1] * y
        frames[count, 2, 3] = z0 + R[2, 0] * x + R[2, 1] * y
        frames[count, 3, 3] = 1.0
        boundary_sizes[count], inset_sizes[count] = min(len(boundary), MAX_VERTICES), len(inset)
        for k in range(boundary_sizes[count]):
            boundaries[count, k, 0], boundaries[count, k, 1] = boundary[k, 0], boundary[k, 1]
        for k in range(len(inset)):
            insets[count, k, 0], insets[count, k, 1] = inset[k, 0], inset[k, 1]
        count += 1
    return frames[:count], boundaries[:count], boundary_sizes[:count], insets[:count], inset_sizes[:count]
