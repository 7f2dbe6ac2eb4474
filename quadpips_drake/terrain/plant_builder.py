"""Puts a terrain into a MultibodyPlant: what robots touch, and what is drawn. (What cameras see: ``camera_scene.py``.)"""

import numpy as np
from pydrake.geometry import Box as BoxShape
from pydrake.geometry import Convex, GeometryId, InMemoryMesh, ProximityProperties, Role, SceneGraph
from pydrake.geometry import Cylinder as CylinderShape
from pydrake.geometry import Mesh as MeshShape
from pydrake.geometry import Sphere as SphereShape
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant

from quadpips_drake.terrain.element_colors import COLORS, element_colors
from quadpips_drake.terrain.ground_window import GroundWindow, check_density
from quadpips_drake.terrain.terrain import Box, Cylinder, Element, Mesh, Sphere, Terrain
from quadpips_drake.terrain.triangles import in_memory_mesh, joined_triangles

MAX_WHOLE = 200
"""Up to this many shapes of a terrain take part in collisions as a whole, and as many elements are drawn one by one."""
_PREFIX = "terrain_"
"""Of the names of all geometries."""
MESH_THICKNESS = 0.1
"""How far [m] the solid under each triangle of a mesh that is not convex reaches down."""


def add_terrain_to_plant(terrain: Terrain, plant: MultibodyPlant, scene_graph: SceneGraph) -> GroundWindow | None:
    """Fixes the elements of ``terrain`` to the world of ``plant``, where robots touch them and Meshcat shows them.

    Point contact treats meshes as convex; a mesh that is not becomes one thin prism per triangle. Drake's SceneGraph keeps
    a record of each pair of shapes that can touch something: 350 bytes and 4 us for each, 4 GB for 5,000 shapes. So of
    more than MAX_WHOLE shapes only those near the robot take part in collisions; see ``GroundWindow``.

    Args:
        terrain: what to add.
        plant: not finalised yet.
        scene_graph: the one with which the plant is registered.

    Returns: the window through which a large terrain is touched; None when there is no need of one.

    Raises:
        UserInputError: more shapes lie together than a window may hold.
    """
    bounds = _bounds_of_shapes(terrain)
    is_large = len(bounds) > MAX_WHOLE
    one_by_one = len(terrain.elements) <= MAX_WHOLE
    if is_large:
        check_density(terrain.name, bounds)
    if not one_by_one:
        add_terrain_visuals(terrain, plant)
    ids, properties, colors = [], None, element_colors(terrain)
    for index, element in enumerate(terrain.elements):
        # Drake numbers what is registered, and the numbers decide in which order contacts are summed up: the last bits of
        # forces. So this order is kept.
        new = _add_collision_shapes(index, element, plant, terrain.friction)
        if new and properties is None:
            properties = ProximityProperties(scene_graph.model_inspector().GetProximityProperties(new[0]))
        if is_large:
            for id in new:
                scene_graph.RemoveRole(source_id=plant.get_source_id(), geometry_id=id, role=Role.kProximity)
        ids += new
        if one_by_one:
            add_terrain_visual(index, element, plant, colors[index])
    return GroundWindow(scene_graph, plant.get_source_id(), ids, bounds, properties) if is_large else None


def element_index(name: str) -> int:
    """Which element of its terrain a collision geometry with this ``name`` belongs to."""
    return int(name.rsplit(_PREFIX, 1)[1].split("_")[0])


def add_terrain_visuals(terrain: Terrain, plant: MultibodyPlant):
    """Lets cameras (role perception) and Meshcat (illustration) see ``terrain``; for the colours see ``element_colors``.

    Many elements become one mesh for each colour, which is drawn much faster than they would be one by one.
    """
    colors = element_colors(terrain)
    if len(terrain.elements) <= MAX_WHOLE:
        for index, element in enumerate(terrain.elements):
            add_terrain_visual(index, element, plant, colors[index])
        return
    for number, color in enumerate(sorted(set(colors))):
        same = [element for element, its in zip(terrain.elements, colors, strict=True) if its == color]
        shape = MeshShape(in_memory_mesh(*joined_triangles(same)))
        plant.RegisterVisualGeometry(plant.world_body(), RigidTransform(), shape, f"terrain_{number}", np.array(color))


def _add_collision_shapes(index: int, element: Element, plant: MultibodyPlant, friction: float) -> list[GeometryId]:
    X_WE, coulomb = RigidTransform(element.X_WE), CoulombFriction(friction, friction)
    return [
        plant.RegisterCollisionGeometry(plant.world_body(), X_WE, shape, f"{_PREFIX}{index:04d}_{k}", coulomb)
        for k, shape in enumerate(collision_shapes(element))
    ]


def add_terrain_visual(index: int, element: Element, plant: MultibodyPlant, color=None) -> None:
    """Shows one element, as itself, in a ``color`` (red, green, blue, alpha; default: that of its label)."""
    rgba = np.array(color or COLORS[element.label])
    plant.RegisterVisualGeometry(
        plant.world_body(), RigidTransform(element.X_WE), visual_shape(element), f"{_PREFIX}{index:04d}", rgba
    )


def visual_shape(element: Element):
    """The shape in which an element is drawn, in E."""
    if isinstance(element, Mesh):
        return MeshShape(in_memory_mesh(element.vertices, element.triangles))
    return collision_shapes(element)[0]


def collision_shapes(element: Element) -> list:
    """The shapes by which an element is touched, in E."""
    if isinstance(element, Box):
        return [BoxShape(*element.size)]
    if isinstance(element, Cylinder):
        return [CylinderShape(element.radius, element.length)]
    if isinstance(element, Sphere):
        return [SphereShape(element.radius)]
    if _is_convex(element):
        return [Convex(in_memory_mesh(element.vertices, element.triangles))]
    return [Convex(prism) for prism in _prisms(element)]


def num_collision_shapes(element: Element) -> int:
    """How many shapes an element is to the physics: a mesh that is not convex has one for each triangle not vertical."""
    return len(_shape_bounds(element))


def _bounds_of_shapes(terrain: Terrain) -> np.ndarray:
    """Lowest x, y and highest x, y [m] in W of all shapes of a terrain, (n, 2, 2)."""
    if not any(isinstance(element, Mesh) for element in terrain.elements):
        return terrain.element_bounds[:, :, :2]
    return np.concatenate([_shape_bounds(element) for element in terrain.elements])


def _shape_bounds(element: Element) -> np.ndarray:
    """Lowest x, y and highest x, y [m] in W of each shape of ``collision_shapes``, (n, 2, 2)."""
    if isinstance(element, Mesh) and not _is_convex(element):
        corners = element.corners()[element.triangles[_has_prism(element)]]
        return np.stack((corners.min(axis=1), corners.max(axis=1)), axis=1)[:, :, :2]
    return np.array(element.bounds())[None, :, :2]


def _is_convex(mesh: Mesh) -> bool:
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    solid = lengths > 1e-12
    normals = normals[solid] / lengths[solid, None]
    # A closed convex body has no vertex in front of any face; an open sheet has faces on one side only.
    closed = np.abs((normals * lengths[solid, None]).sum(axis=0)).max() < 1e-9 * max(lengths.sum(), 1.0)
    if not closed:
        return False
    return all((normal @ (mesh.vertices - a).T).max() < 1e-6 for normal, a in zip(normals, corners[solid, 0], strict=True))


def _down_E(mesh: Mesh) -> np.ndarray:
    """From the top of a prism to its bottom, in E [m]."""
    return mesh.X_WE[:3, :3].T @ np.array([0.0, 0.0, -MESH_THICKNESS])


def _has_prism(mesh: Mesh) -> np.ndarray:
    """Which triangles are not vertical, bool (m,)."""
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    return np.abs(np.cross(b - a, c - a) @ _down_E(mesh)) > 1e-9


def _prisms(mesh: Mesh) -> list[InMemoryMesh]:
    """One solid per triangle that is not vertical, from the triangle down along the world's vertical."""
    down_E = _down_E(mesh)
    faces = np.array([(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)])
    corners = mesh.vertices[mesh.triangles[_has_prism(mesh)]]
    return [in_memory_mesh(np.concatenate((top, top + down_E)), faces) for top in corners]
