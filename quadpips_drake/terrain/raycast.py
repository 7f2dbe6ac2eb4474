"""Vertical rays against boxes, cylinders and triangles: all elements, many rays, one compiled loop."""

import numpy as np
from numba import njit

from quadpips_drake.terrain.terrain import Box, Cylinder, Element

BOX, CYLINDER, MESH = 0, 1, 2
_TOLERANCE = 1e-12


class ElementArrays:
    """The elements as plain arrays for the compiled loop."""

    def __init__(self, elements: tuple[Element, ...], keep=None):
        chosen = [i for i in range(len(elements)) if keep is None or keep[i]]
        n = len(chosen)
        self.index = np.array(chosen, np.int64)
        self.kind = np.zeros(n, np.int64)
        self.pose = np.zeros((n, 4, 4))
        self.half_size = np.zeros((n, 3))
        """Box: half the size; cylinder: radius, radius, half the length."""
        self.low, self.high = np.zeros((n, 2)), np.zeros((n, 2))
        """Bounds in x and y [m]."""
        self.triangle_range = np.zeros((n, 2), np.int64)
        triangles = []
        count = 0
        for k, i in enumerate(chosen):
            element = elements[i]
            low, high = element.bounds()
            self.pose[k], self.low[k], self.high[k] = element.X_WE, low[:2] - 1e-9, high[:2] + 1e-9
            if isinstance(element, Box):
                self.half_size[k] = 0.5 * element.size
            elif isinstance(element, Cylinder):
                self.kind[k] = CYLINDER
                self.half_size[k] = element.radius, element.radius, 0.5 * element.length
            else:
                self.kind[k] = MESH
                triangles.append(element.corners()[element.triangles])
                self.triangle_range[k] = count, count + len(element.triangles)
                count += len(element.triangles)
        self.triangles = np.concatenate(triangles) if triangles else np.zeros((0, 3, 3))
        """Corners of all triangles in W [m], (t, 3, 3)."""


def cast_down(x: np.ndarray, y: np.ndarray, arrays: ElementArrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns height [m] (n,), element index (n,), upward normal (n, 3) of the highest surface at each x, y (n,)."""
    a = arrays
    heights, slots, normals = _cast_down(
        np.ascontiguousarray(x, float),
        np.ascontiguousarray(y, float),
        (a.kind, a.pose, a.half_size, a.low, a.high),
        a.triangle_range,
        a.triangles,
    )
    elements = np.where(slots >= 0, a.index[slots], -1) if len(a.index) else slots
    return heights, elements, normals


@njit(cache=True)
def _cast_down(x, y, elements, triangle_range, triangles):
    kind, pose, half_size, low, high = elements
    n = len(x)
    heights = np.full(n, np.nan)
    found = np.full(n, -1, np.int64)
    normals = np.full((n, 3), np.nan)
    normal = np.zeros(3)
    for p in range(n):
        best = -np.inf
        for k in range(len(kind)):
            if x[p] < low[k, 0] or x[p] > high[k, 0] or y[p] < low[k, 1] or y[p] > high[k, 1]:
                continue
            if kind[k] == BOX:
                z = _top_of_box(x[p], y[p], pose[k], half_size[k], normal)
            elif kind[k] == CYLINDER:
                z = _top_of_cylinder(x[p], y[p], pose[k], half_size[k], normal)
            else:
                z = _top_of_triangles(x[p], y[p], triangles[triangle_range[k, 0] : triangle_range[k, 1]], normal)
            if z > best:
                best = z
                heights[p] = z
                found[p] = k
                normals[p] = normal
    return heights, found, normals


@njit(cache=True)
def _to_element(x, y, pose, i):
    """Coordinate i in E of the ray (x, y, 0) + z e_z at z = 0, and its slope along z."""
    dx, dy, dz = x - pose[0, 3], y - pose[1, 3], -pose[2, 3]
    return pose[0, i] * dx + pose[1, i] * dy + pose[2, i] * dz, pose[2, i]


@njit(cache=True)
def _top_of_box(x, y, pose, half, normal):
    """Height at which the vertical line at x, y leaves the box upwards (slab method), -inf if it misses."""
    enter, leave = -np.inf, np.inf
    for i in range(3):
        origin, slope = _to_element(x, y, pose, i)
        if abs(slope) < _TOLERANCE:
            if abs(origin) > half[i] + 1e-9:
                return -np.inf
            continue
        sign = 1.0 if slope > 0 else -1.0
        enter = max(enter, (-sign * half[i] - origin) / slope)
        z = (sign * half[i] - origin) / slope
        if z < leave:
            leave = z
            for r in range(3):
                normal[r] = sign * pose[r, i]
    return leave if enter <= leave + 1e-9 else -np.inf


@njit(cache=True)
def _top_of_cylinder(x, y, pose, half, normal):
    """As for the box, with the round side in place of two slabs."""
    ox, sx = _to_element(x, y, pose, 0)
    oy, sy = _to_element(x, y, pose, 1)
    oz, sz = _to_element(x, y, pose, 2)
    enter, leave = -np.inf, np.inf
    a, b, c = sx * sx + sy * sy, ox * sx + oy * sy, ox * ox + oy * oy - half[0] * half[0]
    if a < _TOLERANCE:
        if c > 1e-9:
            return -np.inf
    else:
        discriminant = b * b - a * c
        if discriminant < 0:
            return -np.inf
        enter, leave = (-b - np.sqrt(discriminant)) / a, (-b + np.sqrt(discriminant)) / a
        nx, ny = (ox + sx * leave) / half[0], (oy + sy * leave) / half[0]
        for r in range(3):
            normal[r] = nx * pose[r, 0] + ny * pose[r, 1]
    if abs(sz) < _TOLERANCE:
        return leave if abs(oz) <= half[2] + 1e-9 else -np.inf
    sign = 1.0 if sz > 0 else -1.0
    enter = max(enter, (-sign * half[2] - oz) / sz)
    z = (sign * half[2] - oz) / sz
    if z < leave:
        leave = z
        for r in range(3):
            normal[r] = sign * pose[r, 2]
    return leave if enter <= leave + 1e-9 else -np.inf


@njit(cache=True)
def _top_of_triangles(x, y, triangles, normal):
    """Highest crossing of the vertical line at x, y with the triangles (barycentric coordinates in the xy plane)."""
    best = -np.inf
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]
        area = ux * vy - uy * vx
        if abs(area) < _TOLERANCE:
            continue
        px, py = x - a[0], y - a[1]
        s, r = (px * vy - py * vx) / area, (ux * py - uy * px) / area
        if s < -1e-9 or r < -1e-9 or s + r > 1 + 1e-9:
            continue
        uz, vz = b[2] - a[2], c[2] - a[2]
        z = a[2] + s * uz + r * vz
        if z > best:
            best = z
            n0, n1 = uy * vz - uz * vy, uz * vx - ux * vz
            scale = np.sqrt(n0 * n0 + n1 * n1 + area * area)
            if area < 0:
                scale = -scale
            normal[0], normal[1], normal[2] = n0 / scale, n1 / scale, area / scale
    return best
