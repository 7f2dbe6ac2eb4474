"""Puts a terrain into a MultibodyPlant: what robots touch, what cameras see, what is drawn."""

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import Box as BoxShape
from pydrake.geometry import Convex, InMemoryMesh
from pydrake.geometry import Cylinder as CylinderShape
from pydrake.geometry import Mesh as MeshShape
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant

from quadpips_drake.terrain.terrain import Box, Cylinder, Element, Mesh, Terrain
from quadpips_drake.values.steppability import Steppability

COLORS = {
    Steppability.UNKNOWN: (0.60, 0.60, 0.60, 1.0),
    Steppability.STEPPABLE: (0.70, 0.67, 0.60, 1.0),
    Steppability.PASSABLE: (0.86, 0.62, 0.28, 1.0),
    Steppability.NON_PASSABLE: (0.33, 0.36, 0.42, 1.0),
}
"""Red, green, blue, alpha of the elements by label."""
MESH_THICKNESS = 0.1
"""How far [m] the solid under each triangle of a mesh that is not convex reaches down."""


def add_terrain_to_plant(terrain: Terrain, plant: MultibodyPlant):
    """Fixes the elements of ``terrain`` to the world of ``plant`` (registered with a SceneGraph, not finalised yet).

    Every element gets collision geometry with the terrain's friction and a visual with the colour of its label, in the
    roles perception (cameras) and illustration (Meshcat). Point contact treats meshes as convex; a mesh that is not becomes
    one thin prism per triangle.
    """
    friction = CoulombFriction(terrain.friction, terrain.friction)
    body = plant.world_body()
    for index, element in enumerate(terrain.elements):
        name = f"terrain_{index:04d}"
        X_WE = RigidTransform(element.X_WE)
        for k, shape in enumerate(_collision_shapes(element)):
            plant.RegisterCollisionGeometry(body, X_WE, shape, f"{name}_{k}", friction)
        plant.RegisterVisualGeometry(body, X_WE, _visual_shape(element), name, np.array(COLORS[element.label]))


def _visual_shape(element: Element):
    if isinstance(element, Mesh):
        return MeshShape(in_memory_mesh(element.vertices, element.triangles))
    return _collision_shapes(element)[0]


def _collision_shapes(element: Element) -> list:
    if isinstance(element, Box):
        return [BoxShape(*element.size)]
    if isinstance(element, Cylinder):
        return [CylinderShape(element.radius, element.length)]
    if _is_convex(element):
        return [Convex(in_memory_mesh(element.vertices, element.triangles))]
    return [Convex(prism) for prism in _prisms(element)]


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


def _prisms(mesh: Mesh) -> list[InMemoryMesh]:
    """One solid per triangle that is not vertical, from the triangle down along the world's vertical."""
    down_E = mesh.X_WE[:3, :3].T @ np.array([0.0, 0.0, -MESH_THICKNESS])
    faces = np.array([(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)])
    prisms = []
    for corners in mesh.vertices[mesh.triangles]:
        if abs(np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ down_E) > 1e-9:
            prisms.append(in_memory_mesh(np.concatenate((corners, corners + down_E)), faces))
    return prisms


def in_memory_mesh(vertices: np.ndarray, triangles: np.ndarray) -> InMemoryMesh:
    """Returns triangles (m, 3) between vertices (n, 3) [m] as what Drake's Mesh and Convex take instead of a file."""
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    # Drake's renderer insists on normals: one per triangle, which also keeps edges sharp.
    lines += [f"vn {x:.6g} {y:.6g} {z:.6g}" for x, y, z in normals]
    lines += [f"f {a}//{k} {b}//{k} {c}//{k}" for k, (a, b, c) in enumerate(np.asarray(triangles) + 1, start=1)]
    return InMemoryMesh(mesh_file=MemoryFile("\n".join(lines) + "\n", ".obj", "triangles.obj"))
