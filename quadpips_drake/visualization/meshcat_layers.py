"""Layers of coloured meshes and points in Meshcat whose content changes over time, also in recordings."""

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.perception import BaseField, Fields, PointCloud

from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.visualization.meshes.ground_meshes import checkered_mesh, edge_mesh
from quadpips_drake.visualization.meshes.plan_meshes import goal_mesh, start_mesh
from quadpips_drake.visualization.shapes import ColorMesh, ColorPoints

ROOT = "/quadpips"
_LIGHTS = {"AmbientLight": 1.3, "FillLight": 0.9, "PointLightPositiveX": 5.0, "PointLightNegativeX": 3.0}
"""Softer than Meshcat's own lights, which bleach light ground and bright colours."""


class MeshcatLayers:
    """Shows one drawing per layer at a time; the drawing ``number`` of a layer lies at /quadpips/LAYER/NUMBER."""

    def __init__(self, meshcat: Meshcat, *, keep_history: bool = True):
        self._meshcat = meshcat
        self._keep_history = keep_history

    def replace(self, layer: str, number: int, mesh: ColorMesh | ColorPoints, time: float, *, opacity: float = 1.0):
        """Shows ``mesh`` as the drawing ``number`` of ``layer`` from ``time`` [s] on, in place of ``number - 1``."""
        old, new = f"{ROOT}/{layer}/{number - 1}", f"{ROOT}/{layer}/{number}"
        if number > 1 and self._meshcat.HasPath(old):
            if self._keep_history:
                self._meshcat.SetProperty(old, "visible", False, time)
            else:
                self._meshcat.Delete(old)
        if not mesh:
            return
        if isinstance(mesh, ColorPoints):
            set_color_points(self._meshcat, new, mesh)
        else:
            set_color_mesh(self._meshcat, new, mesh, opacity=opacity)
        if self._keep_history and time > 0:
            self._meshcat.SetProperty(new, "visible", False, 0.0)
        self._meshcat.SetProperty(new, "visible", True, time)


def set_color_mesh(meshcat: Meshcat, path: str, mesh: ColorMesh, *, opacity: float = 1.0):
    """Puts ``mesh`` (positions in W) at ``path``."""
    meshcat.SetTriangleColorMesh(
        path,
        np.asfortranarray(mesh.vertices.T),
        np.asfortranarray(mesh.faces.T.astype(np.int32)),
        np.asfortranarray(mesh.colors.T),
    )
    if opacity < 1.0:
        meshcat.SetProperty(path, "modulated_opacity", opacity)


def set_color_points(meshcat: Meshcat, path: str, points: ColorPoints):
    """Puts ``points`` (positions in W) at ``path``."""
    cloud = PointCloud(len(points.positions), Fields(BaseField.kXYZs | BaseField.kRGBs))
    cloud.mutable_xyzs()[:] = points.positions.T
    # Points are drawn without light, and the browser takes their colours as linear: as they are they would look pale.
    cloud.mutable_rgbs()[:] = np.round(255 * np.asarray(points.colors).T ** 2.2).astype(np.uint8)
    meshcat.SetObject(path, cloud, point_size=points.size)


def draw_course(meshcat: Meshcat, terrain: Terrain, *, has_goal: bool = True):
    """Sets the stage: edges of the ground, start and goal, and the way between them seen from the side.

    Without a goal the floor is checkered, so that one sees how far the robot goes, and the camera looks at the start.
    """
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    meshcat.SetProperty("/Background", "top_color", [0.80, 0.86, 0.93])
    meshcat.SetProperty("/Background", "bottom_color", [0.96, 0.97, 0.98])
    for light, intensity in _LIGHTS.items():
        meshcat.SetProperty(f"/Lights/{light}/<object>", "intensity", intensity)
    edges, floor = edge_mesh(terrain), None if has_goal else checkered_mesh(terrain)
    for name, mesh in (("edges", edges), ("floor", floor)):
        if mesh:
            set_color_mesh(meshcat, f"{ROOT}/ground/{name}", mesh)
    set_color_mesh(meshcat, f"{ROOT}/course/start", start_mesh(terrain))
    if has_goal:
        set_color_mesh(meshcat, f"{ROOT}/course/goal", goal_mesh(terrain))
        look_at_course(meshcat, terrain)
    else:
        look_at_robot(meshcat, terrain.start[:2])


def look_at_course(meshcat: Meshcat, terrain: Terrain):
    """Puts Meshcat's camera on the right of the way from start to goal, so that all of it is in view."""
    start, goal = terrain.start[:2], terrain.goal
    middle, length = 0.5 * (start + goal), max(np.linalg.norm(goal - start), 2.0)
    forward = (goal - start) / length if np.linalg.norm(goal - start) > 0.1 else np.array([1.0, 0.0])
    aside = np.array([forward[1], -forward[0]])
    eye = middle + 0.65 * length * aside - 0.45 * length * forward
    meshcat.SetCameraPose(np.array([*eye, 0.5 * length + 0.2]), np.array([*middle, 0.2]))


def look_at_robot(meshcat: Meshcat, xy: np.ndarray):
    """Puts Meshcat's camera beside and above a robot at ``xy`` (2,) [m] in W."""
    meshcat.SetCameraPose(np.array([xy[0] - 1.2, xy[1] - 2.0, 1.2]), np.array([*xy, 0.4]))
