"""Still pictures of a robot on a terrain, rendered off screen (VTK over EGL, no display needed)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    LightParameter,
    MakeRenderEngineVtk,
    Mesh,
    RenderCameraCore,
    RenderEngineVtkParams,
    Rgba,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from quadpips_drake.terrain.plant_builder import add_terrain_visuals
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.triangles import in_memory_mesh
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.visualization.shapes import ColorMesh

_RENDERER = "snapshot"
_LIGHTS = (((-0.25, 0.45, -1.0), 0.9), ((0.7, 0.5, -0.35), 0.5), ((-0.5, -0.8, -0.25), 0.5))
"""Directions in W and intensities."""
_SKY = (0.90, 0.93, 0.97)


@dataclass(frozen=True)
class ChaseView:
    """A camera that looks at the robot from ``azimuth`` [rad] beside its heading (0 is behind, pi/2 its right side)."""

    distance: float = 3.2
    """[m]"""
    azimuth: float = 0.9
    """[rad]"""
    elevation: float = 0.38
    """[rad]"""
    ahead: float = 0.3
    """How far in front of the base the camera aims [m]."""

    def X_WC(self, p_WB: np.ndarray, yaw: float) -> RigidTransform:
        """Pose of the camera's optical frame (x right, y down, z forward) in W."""
        heading = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        target = np.asarray(p_WB) + self.ahead * heading - [0, 0, 0.2]
        angle = yaw + np.pi + self.azimuth
        level = np.array([np.cos(angle), np.sin(angle), 0.0])
        up = np.array([0.0, 0.0, np.sin(self.elevation)])
        return look_at(target + self.distance * (np.cos(self.elevation) * level + up), target)


def look_at(eye: np.ndarray, target: np.ndarray) -> RigidTransform:
    """Returns the pose in W of an optical frame (x right, y down, z forward) at ``eye`` that looks at ``target``."""
    forward = np.asarray(target, float) - np.asarray(eye, float)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    # Straight down has no horizon: then the top of the picture is +x.
    right = np.array([0.0, -1.0, 0.0]) if np.linalg.norm(right) < 1e-6 else right / np.linalg.norm(right)
    return RigidTransform(
        RotationMatrix(np.column_stack((right, np.cross(forward, right), forward))), np.asarray(eye, float)
    )


class SnapshotRenderer:
    """Poses a robot on a terrain and renders it; build once, render often (some 0.1 s per picture of 1280 x 720)."""

    def __init__(self, robot, terrain: Terrain, *, overlays=(), width: int = 1280, height: int = 720, fov_y: float = 0.75):
        """Builds the scene.

        Args:
            robot: RobotModel.
            terrain: where it stands.
            overlays: ColorMeshes in W that are shown, too (see plan_meshes).
            width, height: size of the pictures [pixels].
            fov_y: vertical field of view [rad].
        """
        self._robot = robot
        builder = DiagramBuilder()
        self._plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
        scene_graph.AddRenderer(_RENDERER, MakeRenderEngineVtk(engine_parameters()))
        add_terrain_visuals(terrain, self._plant)
        robot.add_to_plant(self._plant)
        for i, mesh in enumerate(overlays):
            _add_overlay(self._plant, mesh, f"overlay_{i}")
        self._plant.Finalize()
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._scene_graph = scene_graph
        core = RenderCameraCore(_RENDERER, CameraInfo(width, height, fov_y), ClippingRange(0.05, 100.0), RigidTransform())
        self._camera = ColorRenderCamera(core)

    def render(self, p_WB, rpy_WB, joint_positions, view: ChaseView | RigidTransform | None = None) -> np.ndarray:
        """Returns a picture, uint8 (height, width, 3), of the robot at a pose.

        Args:
            p_WB: base position [m], (3,).
            rpy_WB: roll, pitch, yaw [rad], (3,).
            joint_positions: [rad], (12,).
            view: where the camera is: a ChaseView (default) or the pose X_WC of its optical frame.
        """
        view = ChaseView() if view is None else view
        X_WC = view.X_WC(p_WB, float(rpy_WB[2])) if isinstance(view, ChaseView) else view
        plant_context = self._plant.GetMyMutableContextFromRoot(self._context)
        self._robot.set_state(self._plant, plant_context, p_WB, rpy_WB, joint_positions)
        query = self._scene_graph.get_query_output_port().Eval(self._scene_graph.GetMyContextFromRoot(self._context))
        image = query.RenderColorImage(self._camera, self._scene_graph.world_frame_id(), X_WC)
        return np.array(image.data[:, :, :3])

    def render_log(self, log, times, view: ChaseView | RigidTransform | None = None) -> list[np.ndarray]:
        """Returns pictures at ``times`` [s] of a trial's log (mapping of arrays, as loaded from log.npz)."""
        indices = np.searchsorted(log["time"], np.atleast_1d(times)).clip(0, len(log["time"]) - 1)
        return [self.render(log["p_WB"][i], log["rpy_WB"][i], log["joint_positions"][i], view) for i in indices]


def render_snapshot(
    robot,
    terrain: Terrain,
    path: str | Path,
    *,
    p_WB=None,
    rpy_WB=(0, 0, 0),
    joint_positions=None,
    view=None,
    overlays=(),
) -> None:
    """Writes one picture (PNG) of a robot on a terrain; by default standing at the terrain's start."""
    if p_WB is None:
        x, y, yaw = terrain.start
        p_WB = np.array([x, y, np.nan_to_num(GroundTruth(terrain).height(x, y)) + robot.nominal_base_height])
        rpy_WB = (0.0, 0.0, yaw)
    joints = robot.nominal_joints if joint_positions is None else joint_positions
    save_picture(SnapshotRenderer(robot, terrain, overlays=overlays).render(p_WB, rpy_WB, joints, view), path)


def save_picture(image: np.ndarray, path: str | Path) -> None:
    """Writes ``image``, uint8 (height, width, 3), as a PNG or JPEG file."""
    import cv2

    if not cv2.imwrite(str(path), image[:, :, ::-1]):
        raise OSError(f"cannot write '{path}'")


def film_strip(images: list[np.ndarray], columns: int = 3, gap: int = 6) -> np.ndarray:
    """Returns the pictures side by side, in rows of ``columns``, with white gaps [pixels]."""
    height, width = images[0].shape[:2]
    rows = -(-len(images) // columns)
    columns = min(columns, len(images))
    strip = np.full((rows * (height + gap) - gap, columns * (width + gap) - gap, 3), 255, np.uint8)
    for i, image in enumerate(images):
        row, column = divmod(i, columns)
        strip[row * (height + gap) :, column * (width + gap) :][:height, :width] = image
    return strip


def engine_parameters() -> RenderEngineVtkParams:
    """Of a renderer for pictures to look at: sky and lights, without display."""
    lights = [
        LightParameter(type="directional", frame="world", direction=direction, intensity=intensity)
        for direction, intensity in _LIGHTS
    ]
    return RenderEngineVtkParams(backend="EGL", default_clear_color=_SKY, lights=lights)


def _add_overlay(plant: MultibodyPlant, mesh: ColorMesh, name: str) -> None:
    """Adds the triangles of ``mesh`` to what cameras see: VTK has one colour per geometry, so one geometry per colour."""
    vertices, faces, colors = mesh.vertices, mesh.faces, np.round(mesh.colors, 3)
    of_face = colors[faces[:, 0]] if len(faces) else np.zeros((0, 3))
    for k, color in enumerate(np.unique(of_face, axis=0)):
        chosen = faces[(of_face == color).all(axis=1)]
        used, triangles = np.unique(chosen, return_inverse=True)
        triangles = triangles.reshape(-1, 3)
        # Both windings, because a renderer may skip what it sees from behind.
        shape = Mesh(in_memory_mesh(vertices[used], np.concatenate((triangles, triangles[:, ::-1]))))
        rgba = Rgba(*color, 1.0).rgba
        plant.RegisterVisualGeometry(plant.world_body(), RigidTransform(), shape, f"{name}_{k}", rgba)
