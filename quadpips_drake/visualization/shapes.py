"""Triangles for tubes, balls, discs and polygons, gathered into one coloured mesh.

A browser draws lines one pixel wide and is slow with many objects: one mesh per layer is visible and fast.
"""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class ColorPoints:
    """Coloured points, for what has too many places for triangles."""

    positions: np.ndarray
    """(n, 3) [m]."""
    colors: np.ndarray
    """Red, green, blue of each point, (n, 3)."""
    size: float
    """Edge length of the square that stands for a point [m]."""

    def __bool__(self) -> bool:
        return len(self.positions) > 0


@dataclass
class ColorMesh:
    """Triangles with a colour per vertex; grows by its ``add_`` methods. All positions in one frame [m]."""

    _vertices: list = field(default_factory=list)
    _faces: list = field(default_factory=list)
    _colors: list = field(default_factory=list)
    _count: int = 0

    @property
    def vertices(self) -> np.ndarray:
        """(n, 3) [m]."""
        return np.concatenate(self._vertices) if self._vertices else np.zeros((0, 3))

    @property
    def faces(self) -> np.ndarray:
        """Indices of vertices, int (m, 3)."""
        return np.concatenate(self._faces) if self._faces else np.zeros((0, 3), int)

    @property
    def colors(self) -> np.ndarray:
        """Red, green, blue of each vertex, (n, 3)."""
        return np.concatenate(self._colors) if self._colors else np.zeros((0, 3))

    def __bool__(self) -> bool:
        return self._count > 0

    def add_triangles(self, vertices: np.ndarray, faces: np.ndarray, color):
        """Adds triangles ``faces`` (m, 3) between ``vertices`` (n, 3) in one ``color`` (r, g, b)."""
        self._vertices.append(np.asarray(vertices, float))
        self._faces.append(np.asarray(faces, int) + self._count)
        self._colors.append(np.tile(np.asarray(color[:3], float), (len(vertices), 1)))
        self._count += len(vertices)

    def add_tube(self, points: np.ndarray, radius: float, color, sides: int = 6):
        """Adds a tube of ``radius`` [m] along ``points`` (n, 3)."""
        points = np.asarray(points, float)
        if len(points) < 2:
            return
        tangents = np.gradient(points, axis=0)
        tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-9)
        # Any vector across the whole curve gives a frame; the least aligned axis is the safest.
        across = np.eye(3)[np.argmin(np.abs(tangents).max(axis=0))]
        u = np.cross(tangents, across)
        u /= np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-9)
        v = np.cross(tangents, u)
        angle = 2 * np.pi * np.arange(sides) / sides
        rings = points[:, None] + radius * (np.cos(angle)[:, None] * u[:, None] + np.sin(angle)[:, None] * v[:, None])
        i, k = (grid.ravel() for grid in np.meshgrid(np.arange(len(points) - 1), np.arange(sides), indexing="ij"))
        a, b = i * sides + k, i * sides + (k + 1) % sides
        faces = np.concatenate((np.column_stack((a, b, a + sides)), np.column_stack((b, b + sides, a + sides))))
        self.add_triangles(rings.reshape(-1, 3), faces, color)

    def add_ball(self, center: np.ndarray, radius: float, color, rings: int = 6, sides: int = 10):
        """Adds a sphere of ``radius`` [m]."""
        polar = np.linspace(0, np.pi, rings + 1)
        angle = 2 * np.pi * np.arange(sides) / sides
        unit = np.stack(
            (
                np.outer(np.sin(polar), np.cos(angle)),
                np.outer(np.sin(polar), np.sin(angle)),
                np.outer(np.cos(polar), np.ones(sides)),
            ),
            axis=-1,
        )
        i, k = (grid.ravel() for grid in np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij"))
        a, b = i * sides + k, i * sides + (k + 1) % sides
        faces = np.concatenate((np.column_stack((a, a + sides, b)), np.column_stack((b, a + sides, b + sides))))
        self.add_triangles(np.asarray(center) + radius * unit.reshape(-1, 3), faces, color)

    def add_disc(self, center: np.ndarray, normal: np.ndarray, radius: float, color, sides: int = 16):
        """Adds a flat disc of ``radius`` [m] across ``normal`` (3,)."""
        u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        u /= np.linalg.norm(u)
        angle = 2 * np.pi * np.arange(sides) / sides
        circle = np.outer(np.cos(angle), u) + np.outer(np.sin(angle), np.cross(normal, u))
        self.add_polygon(np.asarray(center) + radius * circle, color)

    def add_polygon(self, corners: np.ndarray, color):
        """Adds a convex polygon with ``corners`` (n, 3) in order."""
        if len(corners) < 3:
            return
        i = np.arange(1, len(corners) - 1)
        self.add_triangles(corners, np.column_stack((np.zeros_like(i), i, i + 1)), color)

    def add_outline(self, corners: np.ndarray, normal: np.ndarray, width: float, color):
        """Adds a flat band of ``width`` [m] along the inner border of the convex polygon ``corners`` (n, 3)."""
        n = len(corners)
        if n < 3:
            return
        center = corners.mean(axis=0)
        distance = np.linalg.norm(corners - center, axis=1, keepdims=True)
        inner = corners + np.minimum(width / np.maximum(distance, 1e-9), 1.0) * (center - corners)
        lift = 5e-4 * np.asarray(normal)
        i = np.arange(n)
        j = (i + 1) % n
        faces = np.concatenate((np.column_stack((i, j, i + n)), np.column_stack((j, j + n, i + n))))
        self.add_triangles(np.concatenate((corners, inner)) + lift, faces, color)
