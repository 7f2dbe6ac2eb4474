"""The surface of terrain elements as triangles."""

from functools import cache

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh

from quadpips_drake.terrain.terrain import Box, Cylinder, Element, Sphere

_SIDES = 32
"""Of the prism that stands for a cylinder, and around a sphere, where these are drawn as triangles."""
_BANDS = 16
"""Of a sphere, from pole to pole."""
BOX_FACES = np.array(((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)))
"""Corners of a box's faces, counter-clockwise from outside (index = 4 ix + 2 iy + iz as in ``Box.corners``)."""


def joined_triangles(elements: list[Element]) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices (n, 3) in W [m] and triangles, int (m, 3), of all ``elements`` together."""
    vertices, triangles, count = [], [], 0
    for element in elements:
        if isinstance(element, Box):
            corners, faces = element.corners(), np.concatenate((BOX_FACES[:, :3], BOX_FACES[:, [0, 2, 3]]))
        elif isinstance(element, Cylinder):
            corners, faces = _cylinder(element)
        elif isinstance(element, Sphere):
            corners, faces = sphere_triangles(element, _SIDES)
        else:
            corners, faces = element.corners(), element.triangles
        vertices.append(corners)
        triangles.append(faces + count)
        count += len(corners)
    return np.concatenate(vertices), np.concatenate(triangles)


def _cylinder(element: Cylinder) -> tuple[np.ndarray, np.ndarray]:
    """A prism: first the ring at the bottom, then that at the top, then the centres of bottom and top."""
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = element.radius * np.column_stack((np.cos(angle), np.sin(angle), np.zeros(_SIDES)))
    half = np.array([0.0, 0.0, 0.5 * element.length])
    p_E = np.concatenate((ring - half, ring + half, [-half, half]))
    i = np.arange(_SIDES)
    k = (i + 1) % _SIDES
    bottom, top = np.full(_SIDES, 2 * _SIDES), np.full(_SIDES, 2 * _SIDES + 1)
    columns = ((i, k, k + _SIDES), (i, k + _SIDES, i + _SIDES), (bottom, k, i), (top, i + _SIDES, k + _SIDES))
    faces = np.concatenate([np.column_stack(corners) for corners in columns])
    return p_E @ element.X_WE[:3, :3].T + element.X_WE[:3, 3], faces


def sphere_triangles(element: Sphere, sides: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in W [m] on a sphere, ``sides`` around it, and triangles between them."""
    points, faces = unit_sphere(sides)
    return element.X_WE[:3, 3] + element.radius * points, faces


@cache
def unit_sphere(sides: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3): the two poles (lower, upper), then ring after ring from below; triangles, int (m, 3)."""
    polar, around = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _BANDS + 1)[1:-1], 2 * np.pi * np.arange(sides) / sides
    rings = np.stack((np.outer(np.cos(polar), np.cos(around)), np.outer(np.cos(polar), np.sin(around))), axis=-1)
    heights = np.broadcast_to(np.sin(polar)[:, None, None], (*rings.shape[:2], 1))
    points = np.concatenate(([[0, 0, -1], [0, 0, 1]], np.concatenate((rings, heights), axis=-1).reshape(-1, 3)))
    i = np.arange(sides)
    k = (i + 1) % sides
    low, high = np.zeros(sides, int), np.ones(sides, int)
    faces = [np.column_stack((low, 2 + k, 2 + i))]
    for ring in range(len(polar) - 1):
        a, b = 2 + ring * sides + i, 2 + ring * sides + k
        faces += [np.column_stack((a, b, b + sides)), np.column_stack((a, b + sides, a + sides))]
    last = 2 + (len(polar) - 1) * sides
    faces.append(np.column_stack((high, last + i, last + k)))
    return points, np.concatenate(faces)


def in_memory_mesh(vertices: np.ndarray, triangles: np.ndarray) -> InMemoryMesh:
    """Returns triangles (m, 3) between vertices (n, 3) [m] as what Drake's Mesh and Convex take instead of a file."""
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices.tolist()]
    # Drake's renderer insists on normals: one per triangle, which also keeps edges sharp.
    lines += [f"vn {x:.6g} {y:.6g} {z:.6g}" for x, y, z in normals.tolist()]
    lines += [f"f {a}//{k} {b}//{k} {c}//{k}" for k, (a, b, c) in enumerate((np.asarray(triangles) + 1).tolist(), start=1)]
    return InMemoryMesh(mesh_file=MemoryFile("\n".join(lines) + "\n", ".obj", "triangles.obj"))
