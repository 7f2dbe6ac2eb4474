"""How deep spheres reach into the elements of a terrain."""

import numpy as np

from quadpips_drake.terrain.raycast import ElementArrays, cast_down
from quadpips_drake.terrain.terrain import Box, Cylinder, Element, Mesh, Sphere, Terrain

_RINGS = ((0.0, 1), (0.5, 8), (0.9, 12))
"""Where the lower half of a sphere is held against a mesh: parts of its radius, and how many points there."""


def sphere_depths(terrain: Terrain, centers: np.ndarray, radius: float) -> np.ndarray:
    """Returns by how much spheres reach into any element, 0 where they do not, (n,) [m].

    It is the least distance by which a sphere would have to be moved to be out of the element; for meshes, under which all
    is solid, the way straight up.

    Args:
        terrain: whose elements.
        centers: of the spheres in W [m], (n, 3).
        radius: [m].
    """
    centers, depths = np.asarray(centers, dtype=float), np.zeros(len(centers))
    for element in terrain.elements:
        low, high = element.bounds()
        near = np.flatnonzero(((centers > low - radius) & (centers < high + radius)).all(axis=1))
        if len(near):
            depths[near] = np.maximum(depths[near], _depths(element, centers[near], radius))
    meshes = [isinstance(element, Mesh) for element in terrain.elements]
    if any(meshes):
        depths = np.maximum(depths, _depths_below(ElementArrays(terrain, keep=meshes), centers, radius))
    return depths


def _depths(element: Element, centers: np.ndarray, radius: float) -> np.ndarray:
    """Into a box, a cylinder or a sphere; 0 into a mesh."""
    local = (centers - element.X_WE[:3, 3]) @ element.X_WE[:3, :3]
    if isinstance(element, Box):
        beyond = np.abs(local) - 0.5 * element.size
    elif isinstance(element, Cylinder):
        around = np.hypot(local[:, 0], local[:, 1]) - element.radius
        beyond = np.column_stack((around, np.abs(local[:, 2]) - 0.5 * element.length))
    elif isinstance(element, Sphere):
        beyond = np.linalg.norm(local, axis=1)[:, None] - element.radius
    else:
        return np.zeros(len(centers))
    distance = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
    return np.maximum(radius - distance, 0.0)


def _depths_below(meshes: ElementArrays, centers: np.ndarray, radius: float) -> np.ndarray:
    """By how much the surface of meshes is above the lower half of each sphere."""
    depths = np.zeros(len(centers))
    for part, count in _RINGS:
        for angle in np.linspace(0.0, 2.0 * np.pi, count, endpoint=False):
            x = centers[:, 0] + part * radius * np.cos(angle)
            y = centers[:, 1] + part * radius * np.sin(angle)
            above = cast_down(x, y, meshes)[0] - (centers[:, 2] - radius * np.sqrt(1.0 - part * part))
            depths = np.maximum(depths, np.nan_to_num(above, nan=0.0))
    return depths
