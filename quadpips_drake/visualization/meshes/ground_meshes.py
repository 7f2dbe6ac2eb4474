"""What makes ground readable in pictures: edges of its elements, and a checkered floor on which one sees motion."""

import numpy as np

from quadpips_drake.terrain.terrain import Box, Terrain
from quadpips_drake.terrain.triangles import BOX_FACES
from quadpips_drake.visualization.shapes import ColorMesh

EDGE_COLOR = (0.25, 0.24, 0.22)
FLOOR_COLOR = (0.50, 0.49, 0.47)
MAX_EDGED = 500
"""Terrains of more boxes are drawn without edges: they would be one dark net."""
_WIDTH = 0.006
"""Of an edge [m]."""
_SQUARE = 0.5
"""Of the floor, along x and y of W [m]."""
_MAX_SQUARES = 64
"""Along a side; larger floors have larger squares."""
_LIFT = 0.001
"""Above the ground [m], so that nothing flickers."""


def edge_mesh(terrain: Terrain) -> ColorMesh:
    """A thin band along the border of each face of a box that looks up."""
    mesh = ColorMesh()
    boxes = [element for element in terrain.elements if isinstance(element, Box)]
    if len(boxes) > MAX_EDGED:
        return mesh
    for box in boxes:
        corners = box.corners()
        for face in corners[BOX_FACES]:
            normal = np.cross(face[1] - face[0], face[2] - face[0])
            normal /= np.linalg.norm(normal)
            if normal[2] > 0.5 and np.linalg.norm(face[1] - face[0]) > 3 * _WIDTH:
                _add_band(mesh, face + _LIFT * normal)
    return mesh


def checkered_mesh(terrain: Terrain) -> ColorMesh:
    """Darker squares on every level top of a box that has room for some, aligned with x and y of W."""
    mesh = ColorMesh()
    for box in terrain.elements:
        if not isinstance(box, Box) or not box.is_walkable:
            continue
        corners = box.corners()
        for face in corners[BOX_FACES]:
            is_level = np.ptp(face[:, 2]) < 1e-6 and face[:, 2].min() >= corners[:, 2].max() - 1e-6
            low, high = face[:, :2].min(axis=0), face[:, :2].max(axis=0)
            is_aligned = np.isclose(np.abs(face[:, :2, None] - np.array([low, high]).T).min(axis=2), 0.0, atol=1e-6).all()
            if is_level and is_aligned and (high - low).min() >= 2 * _SQUARE:
                _add_squares(mesh, low, high, face[0, 2] + _LIFT)
    return mesh


def _add_squares(mesh: ColorMesh, low: np.ndarray, high: np.ndarray, z: float) -> None:
    size = _SQUARE * max(1.0, np.ceil((high - low).max() / (_SQUARE * _MAX_SQUARES)))
    first, last = np.floor(low / size).astype(int), np.ceil(high / size).astype(int)
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(first[0], last[0]), np.arange(first[1], last[1])))
    dark = (i + j) % 2 == 0
    begin = np.column_stack((i, j))[dark] * size
    steps = size * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    corners = np.clip(begin[:, None] + steps, low, high).reshape(-1, 2)
    vertices = np.column_stack((corners, np.full(len(corners), z)))
    start = 4 * np.arange(len(begin))[:, None]
    mesh.add_triangles(vertices, np.concatenate([start + np.array(three) for three in ((0, 1, 2), (0, 2, 3))]), FLOOR_COLOR)


def _add_band(mesh: ColorMesh, corners: np.ndarray) -> None:
    """A band of one width inside the border of a rectangle ``corners`` (4, 3)."""
    along = np.roll(corners, -1, axis=0) - corners
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    inner = corners + _WIDTH * (along - np.roll(along, 1, axis=0))
    i = np.arange(4)
    j = (i + 1) % 4
    faces = np.concatenate((np.column_stack((i, j, i + 4)), np.column_stack((j, j + 4, i + 4))))
    mesh.add_triangles(np.concatenate((corners, inner)), faces, EDGE_COLOR)
