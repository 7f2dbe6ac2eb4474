"""Puts a terrain into the scene that depth cameras look at, such that it renders quickly.

VTK on a processor shades every pixel of every face, hidden or not, and starts anew for each geometry. So boxes and meshes
become one mesh, without the faces that no camera on a walking robot can look at: a fifth to a half of an image's time.
"""

import numpy as np
from pydrake.geometry import Mesh as MeshShape
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from quadpips_drake.terrain.element_colors import COLORS
from quadpips_drake.terrain.plant_builder import MAX_WHOLE, add_terrain_visual
from quadpips_drake.terrain.terrain import Cylinder, Element, Sphere, Terrain
from quadpips_drake.terrain.triangles import in_memory_mesh, joined_triangles
from quadpips_drake.values.steppability import Steppability

_ROUND = (Cylinder, Sphere)
"""What keeps its shape instead of becoming triangles, as long as there are few."""
LOWEST_CAMERA = 0.15
"""A camera is never lower than this above the lowest ground that can be walked on [m]; a Go2 that lies is as low."""


def add_terrain_to_camera_scene(terrain: Terrain, plant: MultibodyPlant) -> None:
    """Gives the world of ``plant`` (not finalised yet) the surfaces of ``terrain``; there is nothing to touch."""
    round_ones = [element for element in terrain.elements if isinstance(element, _ROUND)]
    one_by_one = round_ones if len(round_ones) <= MAX_WHOLE else []
    joined = [element for element in terrain.elements if not (one_by_one and isinstance(element, _ROUND))]
    for index, element in enumerate(one_by_one):
        add_terrain_visual(index, element, plant)
    if joined:
        vertices, triangles = joined_triangles(joined)
        seen = triangles[~is_hidden(vertices[triangles], lowest_ground(terrain.elements))]
        color = np.array(COLORS[Steppability.UNKNOWN])
        shape = MeshShape(in_memory_mesh(vertices, seen))
        plant.RegisterVisualGeometry(plant.world_body(), RigidTransform(), shape, "terrain_surface", color)


def lowest_ground(elements: tuple[Element, ...]) -> float:
    """Height [m] of the lowest top of an element that can be walked on; of any element if none can."""
    tops = [element.bounds()[1][2] for element in elements if element.is_walkable]
    return min(tops or [element.bounds()[1][2] for element in elements])


def is_hidden(corners: np.ndarray, ground: float) -> np.ndarray:
    """Which triangles with ``corners`` (m, 3, 3) in W [m] face down and lie lower than any camera above ``ground`` [m]."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    down = normals[:, 2] < -0.7 * np.linalg.norm(normals, axis=1)
    # Seen from above its own plane, a face that looks down lies behind the element that it bounds.
    return down & (corners[:, :, 2].max(axis=1) <= ground + LOWEST_CAMERA)
