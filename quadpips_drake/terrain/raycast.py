"""Vertical rays against boxes, cylinders, spheres and triangles: all elements, many rays, one compiled loop.

A grid over the elements tells which of them a ray can meet, so that it costs no more among thousands than among ten.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.terrain.terrain import Box, Cylinder, Element, Sphere, Terrain

BOX, CYLINDER, MESH, SPHERE = 0, 1, 2, 3
_TOLERANCE = 1e-12
_CELLS_PER_ELEMENT = 16
"""In how many cells of the grid an element may stand, in the mean; larger elements make larger cells."""


class ElementArrays:
    """The elements as plain arrays for the compiled loop."""

    def __init__(self, terrain: Terrain, keep=None):
        """``keep``: which of the terrain's elements, bool (n,); all of them by default."""
        self.index = np.flatnonzero(np.ones(len(terrain.elements), bool) if keep is None else keep)
        elements, n = [terrain.elements[i] for i in self.index], len(self.index)
        self.kind = np.array([_kind(element) for element in elements], np.int64)
        self.pose = np.array([element.X_WE for element in elements]).reshape(n, 4, 4)
        self.half_size = np.zeros((n, 3))
        """Box: half the size; cylinder: radius, radius, half the length; sphere: its radius, three times."""
        bounds = terrain.element_bounds[self.index]
        self.low, self.high = bounds[:, 0, :2] - 1e-9, bounds[:, 1, :2] + 1e-9
        """Bounds in x and y [m]."""
        self.triangle_range = np.zeros((n, 2), np.int64)
        triangles = []
        count = 0
        for k, element in enumerate(elements):
            if isinstance(element, Box):
                self.half_size[k] = 0.5 * element.size
            elif isinstance(element, Cylinder):
                self.half_size[k] = element.radius, element.radius, 0.5 * element.length
            elif isinstance(element, Sphere):
                self.half_size[k] = element.radius
            else:
                triangles.append(element.corners()[element.triangles])
                self.triangle_range[k] = count, count + len(element.triangles)
                count += len(element.triangles)
        self.triangles = np.concatenate(triangles) if triangles else np.zeros((0, 3, 3))
        """Corners of all triangles in W [m], (t, 3, 3)."""
        self.grid = _grid_over(self.low, self.high)


class _Grid(NamedTuple):
    """A rectangle of ``side`` x ``side`` cells, with the elements whose bounds reach into each of them."""

    low: np.ndarray
    """Its lower corner, x and y [m]."""
    high: np.ndarray
    cell: np.ndarray
    """Sides of a cell [m], (2,)."""
    side: int
    offsets: np.ndarray
    """Where the elements of each cell begin in ``items``, int64 (side^2 + 1,)."""
    items: np.ndarray
    """Elements in rising order, cell after cell."""


def _kind(element: Element) -> int:
    kinds = ((Box, BOX), (Cylinder, CYLINDER), (Sphere, SPHERE))
    return next((kind for shape, kind in kinds if isinstance(element, shape)), MESH)


def _grid_over(low: np.ndarray, high: np.ndarray) -> _Grid:
    """The grid over elements with bounds ``low`` and ``high`` (n, 2): as many cells as elements, or fewer large ones."""
    n = len(low)
    if n == 0:
        return _Grid(np.full(2, np.inf), np.full(2, -np.inf), np.ones(2), 1, np.zeros(2, np.int64), np.zeros(0, np.int64))
    first, last = low.min(axis=0), high.max(axis=0)
    side = int(np.ceil(np.sqrt(n)))
    while True:
        cell = (last - first) / side
        begin, end = (np.minimum((bound - first) / cell, side - 1).astype(np.int64) for bound in (low, high))
        covered = (end - begin + 1).prod(axis=1)
        if side == 1 or covered.sum() <= _CELLS_PER_ELEMENT * n:
            break
        side //= 2
    owner = np.repeat(np.arange(n), covered)
    k = np.arange(len(owner)) - np.repeat(np.cumsum(covered) - covered, covered)
    rows = (end - begin + 1)[owner, 1]
    place = (begin[owner, 0] + k // rows) * side + begin[owner, 1] + k % rows
    offsets = np.append(0, np.cumsum(np.bincount(place, minlength=side * side)))
    return _Grid(first, last, cell, side, offsets, owner[np.argsort(place, kind="stable")])


def cast_down(x: np.ndarray, y: np.ndarray, arrays: ElementArrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns height [m] (n,), element index (n,), upward normal (n, 3) of the highest surface at each x, y (n,)."""
    a = arrays
    heights, slots, normals = _cast_down(
        np.ascontiguousarray(x, float),
        np.ascontiguousarray(y, float),
        (a.kind, a.pose, a.half_size, a.low, a.high),
        a.grid,
        a.triangle_range,
        a.triangles,
    )
    elements = np.where(slots >= 0, a.index[slots], -1) if len(a.index) else slots
    return heights, elements, normals


@njit(cache=True)
def _cast_down(x, y, elements, grid, triangle_range, triangles):
    kind, pose, half_size, low, high = elements
    n = len(x)
    heights = np.full(n, np.nan)
    found = np.full(n, -1, np.int64)
    normals = np.full((n, 3), np.nan)
    normal = np.zeros(3)
    for p in range(n):
        if not (grid.low[0] <= x[p] <= grid.high[0] and grid.low[1] <= y[p] <= grid.high[1]):
            continue  # nor is anything where x or y is NaN
        column = min(int((x[p] - grid.low[0]) / grid.cell[0]), grid.side - 1)
        row = min(int((y[p] - grid.low[1]) / grid.cell[1]), grid.side - 1)
        place = column * grid.side + row
        best = -np.inf
        for i in range(grid.offsets[place], grid.offsets[place + 1]):
            k = grid.items[i]
            if x[p] < low[k, 0] or x[p] > high[k, 0] or y[p] < low[k, 1] or y[p] > high[k, 1]:
                continue
            if kind[k] == BOX:
                z = _top_of_box(x[p], y[p], pose[k], half_size[k], normal)
            elif kind[k] == CYLINDER:
                z = _top_of_cylinder(x[p], y[p], pose[k], half_size[k], normal)
            elif kind[k] == SPHERE:
                z = _top_of_sphere(x[p], y[p], pose[k], half_size[k, 0], normal)
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
def _top_of_sphere(x, y, pose, radius, normal):
    """Height of the upper half of a sphere at x, y, -inf beside it."""
    dx, dy = x - pose[0, 3], y - pose[1, 3]
    square = radius * radius - dx * dx - dy * dy
    if square < 0:
        return -np.inf
    up = np.sqrt(square)
    normal[0], normal[1], normal[2] = dx / radius, dy / radius, up / radius
    return pose[2, 3] + up


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
