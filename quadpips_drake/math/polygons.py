"""Convex polygons in the plane: float64 arrays (n, 2), counter-clockwise, n = 0 for the empty one. All in numba."""

import numpy as np
from numba import njit


@njit(cache=True)
def convex_hull(points):
    """Returns the convex hull of ``points`` (n, 2), without collinear vertices (monotone chain)."""
    n = len(points)
    if n < 3:
        return np.empty((0, 2))
    # Lexicographic order by two stable sorts.
    order = np.argsort(points[:, 1], kind="mergesort")
    order = order[np.argsort(points[order, 0], kind="mergesort")]
    chain = np.empty((2 * n, 2))
    size, floor = 0, 1
    for sweep in range(2):
        for k in range(n):
            p = points[order[k]] if sweep == 0 else points[order[n - 1 - k]]
            if sweep == 1 and k == 0:
                continue
            while size > floor and _turn(chain[size - 2], chain[size - 1], p) <= 1e-12:
                size -= 1
            chain[size, 0], chain[size, 1] = p[0], p[1]
            size += 1
        floor = size
    size -= 1  # the first point comes again as the last
    return chain[:size].copy() if size >= 3 else np.empty((0, 2))


@njit(cache=True, inline="always")
def _turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@njit(cache=True)
def clip_half_plane(polygon, nx, ny, offset):
    """Returns the part of ``polygon`` with nx x + ny y <= offset."""
    n = len(polygon)
    result = np.empty((n + 1, 2))
    size = 0
    for k in range(n):
        p, q = polygon[k], polygon[(k + 1) % n]
        dp = nx * p[0] + ny * p[1] - offset
        dq = nx * q[0] + ny * q[1] - offset
        if dp <= 0 and size <= n:
            result[size, 0], result[size, 1] = p[0], p[1]
            size += 1
        if (dp < 0 < dq or dq < 0 < dp) and size <= n:
            t = dp / (dp - dq)
            result[size, 0] = p[0] + t * (q[0] - p[0])
            result[size, 1] = p[1] + t * (q[1] - p[1])
            size += 1
    return result[:size].copy() if size >= 3 else np.empty((0, 2))


@njit(cache=True)
def clipped_area(polygon, nx, ny, offset):
    """Returns the area of the part of ``polygon`` with nx x + ny y <= offset, without making it."""
    n = len(polygon)
    twice = 0.0
    first_x = first_y = last_x = last_y = 0.0
    size = 0
    for k in range(n):
        p, q = polygon[k], polygon[(k + 1) % n]
        dp, dq = nx * p[0] + ny * p[1] - offset, nx * q[0] + ny * q[1] - offset
        for corner in range(2):
            if corner == 0 and dp <= 0:
                x, y = p[0], p[1]
            elif corner == 1 and (dp < 0 < dq or dq < 0 < dp):
                t = dp / (dp - dq)
                x, y = p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])
            else:
                continue
            if size == 0:
                first_x, first_y = x, y
            else:
                twice += (last_x - first_x) * (y - first_y) - (last_y - first_y) * (x - first_x)
            last_x, last_y = x, y
            size += 1
    return 0.5 * twice


@njit(cache=True)
def half_planes(polygon):
    """Returns (nx, ny, offset) of each edge, (k, 3): inside is nx x + ny y <= offset. Edges without length are left out."""
    lines = np.empty((len(polygon), 3))
    size = 0
    for k in range(len(polygon)):
        p, q = polygon[k], polygon[(k + 1) % len(polygon)]
        ex, ey = q[0] - p[0], q[1] - p[1]
        length = np.sqrt(ex * ex + ey * ey)
        if length < 1e-9:
            continue
        lines[size, 0], lines[size, 1] = ey / length, -ex / length
        lines[size, 2] = lines[size, 0] * p[0] + lines[size, 1] * p[1]
        size += 1
    return lines[:size]


@njit(cache=True)
def shrink(polygon, distance):
    """Returns the points of ``polygon`` that are at least ``distance`` inside every edge."""
    result = polygon.copy()
    for nx, ny, offset in half_planes(polygon):
        result = clip_half_plane(result, nx, ny, offset - distance)
        if len(result) == 0:
            break
    return result


@njit(cache=True)
def grow(polygon, distance):
    """Returns ``polygon`` with every edge moved outward by ``distance``; corners stay corners, the sharpest are cut off."""
    reach = 1.25 * distance
    low_x, high_x = polygon[:, 0].min() - reach, polygon[:, 0].max() + reach
    low_y, high_y = polygon[:, 1].min() - reach, polygon[:, 1].max() + reach
    result = np.array([[low_x, low_y], [high_x, low_y], [high_x, high_y], [low_x, high_y]])
    for nx, ny, offset in half_planes(polygon):
        result = clip_half_plane(result, nx, ny, offset + distance)
    return result


@njit(cache=True)
def simplify(polygon, max_vertices):
    """Returns ``polygon`` with the vertices of least area removed until ``max_vertices`` are left; it only gets smaller."""
    result = polygon.copy()
    size = len(result)
    while size > max(3, max_vertices):
        least, index = np.inf, 0
        for k in range(size):
            area = _turn(result[k - 1 if k > 0 else size - 1], result[k], result[(k + 1) % size])
            if area < least:
                least, index = area, k
        for k in range(index, size - 1):
            result[k, 0], result[k, 1] = result[k + 1, 0], result[k + 1, 1]
        size -= 1
    return result[:size].copy()


@njit(cache=True)
def area_and_centroid(polygon):
    """Returns (area, x, y); the centroid of an empty or flat polygon is NaN."""
    area = cx = cy = 0.0
    n = len(polygon)
    for k in range(1, n - 1):
        piece = 0.5 * _turn(polygon[0], polygon[k], polygon[k + 1])
        area += piece
        cx += piece * (polygon[0, 0] + polygon[k, 0] + polygon[k + 1, 0]) / 3.0
        cy += piece * (polygon[0, 1] + polygon[k, 1] + polygon[k + 1, 1]) / 3.0
    if area <= 0:
        return 0.0, np.nan, np.nan
    return area, cx / area, cy / area


@njit(cache=True)
def distance_inside(polygon, x, y):
    """Returns the distance of (x, y) from the nearest edge's line, positive inside; -inf for an empty polygon."""
    nearest = np.inf if len(polygon) >= 3 else -np.inf
    for k in range(len(polygon)):
        p, q = polygon[k], polygon[(k + 1) % len(polygon)]
        ex, ey = q[0] - p[0], q[1] - p[1]
        length = np.sqrt(ex * ex + ey * ey)
        if length > 1e-9:
            nearest = min(nearest, (ex * (y - p[1]) - ey * (x - p[0])) / length)
    return nearest
