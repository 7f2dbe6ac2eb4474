"""The depth camera: pinhole parameters, and the renderer that plays its part in simulation."""

import ctypes
import math

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    FrameId,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_description import CameraMount
from quadpips_drake.values.sensing import CameraIntrinsics

_RENDERER = "depth"


MAX_PIXELS = 2_100_000
"""Largest image: full HD. Perception needs some 500 bytes a pixel."""


@configuration
class DepthCameraConfig:
    """An ideal pinhole depth camera; the defaults are those of the simulated RealSense D435 of QuadPiPS."""

    width: int = ranged(640, 8, 4096)
    """Columns of the image [pixels]."""
    height: int = ranged(480, 8, 4096)
    """Rows of the image [pixels]."""
    horizontal_fov: float = ranged(1.48702, 0.1, 2.8)
    """Horizontal field of view [rad] (85.2 degrees)."""
    min_range: float = ranged(0.1, 0.01, 100.0)
    """Least depth that is measured [m]."""
    max_range: float = ranged(3.0, 0.02, 100.0)
    """Largest depth that is measured [m]."""

    def __post_init__(self):
        if self.width * self.height > MAX_PIXELS:
            raise UserInputError(f"width x height must be at most {MAX_PIXELS} pixels, not {self.width} x {self.height}")
        if not self.min_range < self.max_range:
            raise UserInputError(f"min_range must be below max_range, {self.max_range:g} m, not {self.min_range:g} m")


def make_intrinsics(config: DepthCameraConfig) -> CameraIntrinsics:
    """Returns the pinhole parameters: square pixels, optical axis through the middle of the image.

    Whole numbers u, v mean the centres of pixels, so the middle of the image is at (width - 1)/2, (height - 1)/2.
    """
    focal = 0.5 * config.width / math.tan(0.5 * config.horizontal_fov)
    return CameraIntrinsics(config.width, config.height, focal, focal, 0.5 * config.width - 0.5, 0.5 * config.height - 0.5)


def check_renderer() -> None:
    """Raises UserInputError when this machine lacks what headless rendering needs.

    Without this check, VTK would print a warning and end the process at the first image.
    """
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        raise UserInputError(
            "cannot render depth images: libEGL.so.1 is missing; install the Debian package libegl1 (with apt)"
        ) from None
    if _count_egl_devices(egl) == 0:
        raise UserInputError(
            "cannot render depth images: EGL finds no driver; install the Debian package libegl-mesa0 (with apt)"
        )


def _count_egl_devices(egl: ctypes.CDLL) -> int:
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    address = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    if not address:
        return 0
    query = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_int))(address)
    count = ctypes.c_int(0)
    return count.value if query(0, None, ctypes.byref(count)) else 0


def add_depth_camera(
    builder: DiagramBuilder, scene_graph: SceneGraph, base: FrameId, mount: CameraMount, config: DepthCameraConfig
) -> RgbdSensor:
    """Adds an RgbdSensor named "<mount>_camera", fixed to the frame ``base``; it renders with VTK over EGL, without display.

    Its sensor body frame is the optical frame C, so its output ``body_pose_in_world`` is X_WC. An image is rendered when it
    is read at a new time, and shows that time; whoever reads sets the frame rate.
    """
    check_renderer()
    if not scene_graph.HasRenderer(_RENDERER):
        scene_graph.AddRenderer(_RENDERER, MakeRenderEngineVtk(RenderEngineVtkParams(backend="EGL")))
    intrinsics = make_intrinsics(config)
    info = CameraInfo(
        intrinsics.width, intrinsics.height, intrinsics.fx, intrinsics.fy, intrinsics.cx + 0.5, intrinsics.cy + 0.5
    )
    clipping = ClippingRange(0.5 * config.min_range, config.max_range + 1.0)
    core = RenderCameraCore(_RENDERER, info, clipping, RigidTransform())
    camera = DepthRenderCamera(core, DepthRange(config.min_range, config.max_range))
    sensor = builder.AddSystem(RgbdSensor(base, RigidTransform(np.array(mount.X_BC)), camera))
    sensor.set_name(f"{mount.name}_camera")
    return sensor
