"""Coloured meshes in a scene that a renderer looks at, put there, moved and taken away between two pictures."""

import numpy as np
from pydrake.geometry import GeometryInstance, Mesh, PerceptionProperties, RenderLabel, Rgba, SceneGraph
from pydrake.math import RigidTransform

from quadpips_drake.terrain.triangles import in_memory_mesh
from quadpips_drake.visualization.shapes import ColorMesh


class SceneMeshes:
    """The named meshes of a source of its own in a SceneGraph; they live in a context."""

    def __init__(self, scene_graph: SceneGraph):
        """Registers the source: before contexts are made."""
        self._scene_graph, self._source = scene_graph, scene_graph.RegisterSource("drawings")
        self._shown: dict[str, list] = {}
        self._count = 0

    def show(self, root_context, name: str, mesh: ColorMesh | None, X_WM: RigidTransform | None = None) -> None:
        """Shows ``mesh`` (at the pose ``X_WM``) in place of what had the ``name``; None or an empty one: nothing."""
        scene, context = self._scene_graph, self._scene_graph.GetMyMutableContextFromRoot(root_context)
        for geometry in self._shown.pop(name, []):
            scene.RemoveGeometry(context, self._source, geometry)
        if not mesh:
            return
        shown = []
        for color, vertices, triangles in parts_of_one_color(mesh):
            self._count += 1
            # Both windings, because a renderer may skip what it sees from behind.
            shape = Mesh(in_memory_mesh(vertices, np.concatenate((triangles, triangles[:, ::-1]))))
            instance = GeometryInstance(X_WM or RigidTransform(), shape, f"drawing_{self._count}")
            geometry = scene.RegisterGeometry(context, self._source, scene.world_frame_id(), instance)
            properties = PerceptionProperties()
            properties.AddProperty("phong", "diffuse", Rgba(*color, 1.0))
            properties.AddProperty("label", "id", RenderLabel.kDontCare)
            scene.AssignRole(context, self._source, geometry, properties)
            shown.append(geometry)
        self._shown[name] = shown


def parts_of_one_color(mesh: ColorMesh):
    """Yields color (r, g, b), vertices (n, 3) and triangles (m, 3) of each colour: VTK has one colour per geometry."""
    vertices, faces, colors = mesh.vertices, mesh.faces, np.round(mesh.colors, 2)
    of_face = colors[faces[:, 0]] if len(faces) else np.zeros((0, 3))
    for color in np.unique(of_face, axis=0):
        used, triangles = np.unique(faces[(of_face == color).all(axis=1)], return_inverse=True)
        yield color, vertices[used], triangles.reshape(-1, 3)
