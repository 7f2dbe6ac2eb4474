"""Depth and label images of a scene, from Drake's renderer."""

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    GeometryId,
    MakeRenderEngineVtk,
    Mesh,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    Rgba,
)
from pydrake.math import RigidTransform
from pydrake.systems.sensors import CameraInfo, ImageDepth32F, ImageLabel16I

from quadpips_drake.learning.scenes import Scene
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, check_renderer, make_intrinsics
from quadpips_drake.terrain.triangles import in_memory_mesh
from quadpips_drake.values.steppability import Steppability

LABELS = (Steppability.STEPPABLE, Steppability.PASSABLE, Steppability.NON_PASSABLE)


class SceneRenderer:
    """Renders scenes, one after the other, with RenderEngineVtk; all surfaces of one label are one geometry.

    The engine is used directly, without a SceneGraph: making one for each scene would cost more than the images.
    """

    def __init__(self, camera: DepthCameraConfig):
        check_renderer()
        self._engine = MakeRenderEngineVtk(RenderEngineVtkParams(backend="EGL"))
        self.intrinsics = make_intrinsics(camera)
        k = self.intrinsics
        info = CameraInfo(k.width, k.height, k.fx, k.fy, k.cx + 0.5, k.cy + 0.5)
        core = RenderCameraCore("", info, ClippingRange(0.5 * camera.min_range, 30.0), RigidTransform())
        self._depth_camera = DepthRenderCamera(core, DepthRange(camera.min_range, camera.max_range))
        self._label_camera = ColorRenderCamera(core, False)
        self._depth = ImageDepth32F(k.width, k.height)
        self._labels = ImageLabel16I(k.width, k.height)
        self._shown: list[GeometryId] = []

    def show(self, scene: Scene) -> None:
        """Replaces what is rendered by ``scene``."""
        for geometry in self._shown:
            self._engine.RemoveGeometry(geometry)
        self._shown = []
        for label in LABELS:
            triangles = scene.triangles(label)
            if len(triangles):
                self._shown.append(self._register(triangles, label))

    def render(self, X_WC: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns depth [m] and labels as seen from the pose ``X_WC`` (4, 4) of the optical frame.

        Depth is float32 (height, width), NaN where nothing is in range; labels are uint8, UNKNOWN there.
        """
        self._engine.UpdateViewpoint(RigidTransform(X_WC))
        self._engine.RenderDepthImage(self._depth_camera, self._depth)
        self._engine.RenderLabelImage(self._label_camera, self._labels)
        depth = self._depth.data[:, :, 0].copy()
        labels = self._labels.data[:, :, 0]
        seen = np.isfinite(depth) & (depth > 0) & (labels >= LABELS[0]) & (labels <= LABELS[-1])
        depth[~seen] = np.nan
        return depth, np.where(seen, labels, Steppability.UNKNOWN).astype(np.uint8)

    def _register(self, triangles: np.ndarray, label: Steppability) -> GeometryId:
        properties = PerceptionProperties()
        properties.AddProperty("label", "id", RenderLabel(int(label)))
        properties.AddProperty("phong", "diffuse", Rgba(0.5, 0.5, 0.5, 1))
        mesh = Mesh(in_memory_mesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)))
        geometry = GeometryId.get_new_id()
        self._engine.RegisterVisual(geometry, mesh, properties, RigidTransform(), False)
        return geometry
