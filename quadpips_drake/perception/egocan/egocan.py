"""The legged egocan: what the camera has seen, wrapped around the robot (QuadPiPS sections IV-A, V-C; equations 1-4).

The can is a cylinder around the camera's optical centre, closed below by a cap; frame E stands at the optical centre,
aligned with gravity and with the yaw of the base (x right, y down, z forward). A surface point belongs to the cylinder
when |y|/rho < v_fov/2 with rho = sqrt(x^2 + z^2), and else, below the camera, to the cap.

Where we depart from the paper. It moves the content of every pixel into the next can (equation 3); points that meet in one
pixel are lost and the floor behind the robot thins out within a few steps. We keep each measured piece of ground where it
was measured, in a window of small square cells that is fixed to the world and travels with the robot cell by cell
(ground_memory.py), and draw the cap from it in one go, so that each piece of ground is resampled once and not once
per frame. The points of the cylinder are moved exactly as in equation 3.

The cap is drawn straight down (``cap_pixel``), not along the rays of equation 4: on the way up stairs those rays are
blocked by each tread's edge, which hides more than a third of the next tread behind the robot although the camera saw it.
With ``cap_pixel: 0`` the rays are the paper's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.perception.egocan import egocan_kernels as kernels
from quadpips_drake.perception.egocan.ground_memory import (
    GroundMemory,
    GroundMemoryConfig,
    assume_ground,
    measure_ground,
    scroll_to,
)
from quadpips_drake.perception.egocan.parallel_cap import draw_parallel_cap
from quadpips_drake.perception.egocan.view_kernels import pack_camera
from quadpips_drake.values.images import AffordanceImage, EgocanImage
from quadpips_drake.values.immutable import ImmutableValue


@configuration
class EgocanConfig(StageConfig):
    """Parameters of the legged egocan."""

    rate: float = stage_rate(30.0)
    """How often an image is taken in [Hz] (QuadPiPS: 30 and more)."""

    v_fov: float = ranged(0.7854, 0.7844, 1.5718)
    """Vertical field of view of the cylinder [rad], 45..90 deg. The cap covers the disc of ground within 2/v_fov camera
    heights of the camera: 2.5 at 45 deg, which reaches behind the hind feet of ANYmal C with its front camera."""
    cap_size: int = ranged(256, 16, 1024)
    """Width and height of the cap [pixels]."""
    cap_pixel: float = ranged(0.0135, 0.002, 0.1, zero=True)
    """Side of a pixel of the cap [m], which is drawn straight down; 0 draws it along the rays of equation 4."""
    cylinder_width: int = ranged(256, 16, 2048)
    """Columns of the cylinder, over 360 deg [pixels]."""
    cylinder_height: int = ranged(120, 16, 1024)
    """Rows of the cylinder, over v_fov [pixels]."""
    cylinder_stride: int = ranged(2, 1, 100)
    """Every how many pixels of the depth image a point goes onto the (much coarser) cylinder [pixels]."""
    max_jump: float = ranged(0.5, 0.001, 100.0)
    """The memory is dropped when the camera moves further than this between two images [m]."""
    max_turn: float = ranged(0.7, 0.001, 4.0)
    """The memory is dropped when the base yaws further than this between two images [rad]."""
    ground: GroundMemoryConfig = field(default_factory=GroundMemoryConfig)

    @property
    def cap_focal(self) -> float:
        """f_low of equation 4: pixels per unit of x/|y|."""
        return self.v_fov * self.cap_size / 4


@dataclass(frozen=True, eq=False)
class EgocanMemory(ImmutableValue):
    """Everything that the egocan remembers between two images; frame W."""

    stamp: float
    """Time of the newest depth image in it [s]; -inf before the first one."""
    X_WE: np.ndarray
    """Pose of the egocan frame at that time, (4, 4)."""
    ground: GroundMemory
    cylinder_points: np.ndarray
    """The point that each pixel of the cylinder holds [m], float32 (h_cyl, w_cyl, 3); NaN where none."""
    cylinder_normals: np.ndarray
    """Unit normals, float32 (h_cyl, w_cyl, 3)."""
    cylinder_labels: np.ndarray
    """Steppability, uint8 (h_cyl, w_cyl)."""

    @staticmethod
    def empty(config: EgocanConfig) -> "EgocanMemory":
        """Returns the memory of a robot that has seen nothing yet."""
        shape = (config.cylinder_height, config.cylinder_width)
        return EgocanMemory(
            stamp=-np.inf,
            X_WE=np.eye(4),
            ground=GroundMemory.empty(config.ground),
            cylinder_points=np.full((*shape, 3), np.nan, np.float32),
            cylinder_normals=np.full((*shape, 3), np.nan, np.float32),
            cylinder_labels=np.zeros(shape, np.uint8),
        )


def egocan_frame(p_WC: np.ndarray, yaw: float) -> np.ndarray:
    """Returns X_WE (4, 4): origin at ``p_WC``, x right, y down, z forward along ``yaw``."""
    c, s = np.cos(yaw), np.sin(yaw)
    X_WE = np.eye(4)
    X_WE[:3, :3] = np.array([[s, 0.0, c], [-c, 0.0, s], [0.0, -1.0, 0.0]])
    X_WE[:3, 3] = p_WC
    return X_WE


def yaw_of(X_WE: np.ndarray) -> float:
    """Returns the yaw of the egocan frame [rad]."""
    return float(np.arctan2(X_WE[1, 2], X_WE[0, 2]))


def begin_memory(
    images: Sequence[AffordanceImage], yaw: float, X_WB: np.ndarray, p_WG: np.ndarray, config: EgocanConfig
) -> EgocanMemory:
    """Returns the memory at the start: the first images, and the assumption that the robot stands on flat ground.

    QuadPiPS section V-D.2 assumes that planning begins on flat, obstacle-free terrain and fills in unseen floor. Here the
    assumption is limited to a rectangle around the feet, it is the plane through the feet, it never reaches into a camera's
    view, and any measurement overrules it. ``images``: as for ``update_memory``; ``p_WG``: ground points under the feet [m],
    (4, 3).
    """
    memory = EgocanMemory.empty(config)
    if not usable(images, yaw):
        return memory
    X_WE = egocan_frame(images[0].X_WC[:3, 3], yaw)
    ground = scroll_to(memory.ground, X_WE[:3, 3], config.ground)
    ground = assume_ground(ground, images, X_WB, p_WG, config.ground)
    memory = EgocanMemory(-np.inf, X_WE, ground, memory.cylinder_points, memory.cylinder_normals, memory.cylinder_labels)
    return update_memory(memory, images, yaw, config)


def update_memory(memory: EgocanMemory, images: Sequence[AffordanceImage], yaw: float, config: EgocanConfig) -> EgocanMemory:
    """Returns ``memory`` moved to the newest pose and overwritten with what ``images`` show.

    Args:
        memory: before.
        images: of all cameras, taken at the same time. The can stands at the first camera. Images without pixels are
            skipped; if none has any, or they are not newer than the memory, nothing changes.
        yaw: of the base [rad].
        config: of the egocan.
    """
    if not usable(images, yaw) or not images[0].stamp > memory.stamp:
        return memory
    X_WE = egocan_frame(images[0].X_WC[:3, 3], yaw)
    if _jumped(memory, X_WE, config):
        memory = EgocanMemory.empty(config)
    stamp, images = images[0].stamp, [image for image in images if image.depth.size > 0]
    ground = measure_ground(memory.ground, images, X_WE[:3, 3], config.ground)
    points, normals, labels = _update_cylinder(memory, images, X_WE, config)
    return EgocanMemory(stamp, X_WE, ground, points, normals, labels)


def usable(images: Sequence[AffordanceImage], yaw: float) -> bool:
    """Whether the pose of the first camera is known and any camera shows anything."""
    known = np.isfinite(images[0].stamp) and np.isfinite(yaw)
    return bool(known and any(image.depth.size > 0 for image in images))


def _jumped(memory: EgocanMemory, X_WE: np.ndarray, config: EgocanConfig) -> bool:
    """Whether the pose estimate jumped, so that old points no longer fit the new frame."""
    if not np.isfinite(memory.stamp):
        return False
    moved = np.linalg.norm(X_WE[:3, 3] - memory.X_WE[:3, 3])
    turned = np.arccos(np.clip(X_WE[:3, 2] @ memory.X_WE[:3, 2], -1.0, 1.0))
    return bool(moved > config.max_jump or turned > config.max_turn)


def _update_cylinder(memory: EgocanMemory, images: list[AffordanceImage], X_WE: np.ndarray, config: EgocanConfig):
    """Returns points, normals (both in W) and labels of the new cylinder (equations 1-3; the smallest range wins)."""
    shape = (config.cylinder_height, config.cylinder_width)
    points = np.full((*shape, 3), np.nan, np.float32)
    normals = np.full((*shape, 3), np.nan, np.float32)
    labels = np.zeros(shape, np.uint8)
    ranges = np.full(shape, np.inf, np.float32)
    canvas = (X_WE, config.v_fov, ranges, points, normals, labels)
    cameras = [pack_camera(image.X_WC, image.intrinsics) for image in images]
    old = (memory.cylinder_points, memory.cylinder_normals, memory.cylinder_labels)
    kept = kernels.known_pixels(memory.cylinder_points)
    for image, camera in zip(images, cameras, strict=True):
        kept = kernels.still_believed(kept, memory.cylinder_points, image.depth, camera, config.ground.see_through)
    kernels.move_cylinder(kept, *old, *canvas)
    for image, camera in zip(images, cameras, strict=True):
        kernels.add_to_cylinder(image.depth, image.normals, image.labels, camera, config.cylinder_stride, *canvas)
    return points, normals, labels


def draw_egocan(memory: EgocanMemory, config: EgocanConfig) -> EgocanImage:
    """Returns the images of cylinder and floor cap as seen from the newest pose in ``memory``."""
    size, ground = config.cap_size, memory.ground
    height, labels = np.empty((size, size), np.float32), np.empty((size, size), np.uint8)
    normals = np.empty((size, size, 3), np.float32)
    if config.cap_pixel > 0:
        cells = (ground.height, ground.normal, ground.label, ground.count, ground.missed)
        where = (config.ground.trusted_share, ground.first_cell, config.ground.cell, memory.X_WE)
        draw_parallel_cap(cells, *where, config.cap_focal, config.cap_pixel, height, normals, labels)
    else:
        height[:], normals[:], labels[:] = np.inf, np.nan, 0
        cells = (ground.trusted_height(config.ground), ground.normal, ground.label, ground.first_cell, config.ground.cell)
        kernels.draw_cap(*cells, memory.X_WE, config.cap_focal, height, normals, labels)
        height[~np.isfinite(height)] = np.nan
    return EgocanImage(
        stamp=memory.stamp,
        X_WE=memory.X_WE,
        cap_height=height,
        cap_normals=normals,
        cap_labels=labels,
        cap_focal=config.cap_focal,
        cap_pixel=config.cap_pixel,
        cylinder_points_W=memory.cylinder_points,
        cylinder_normals_W=memory.cylinder_normals,
        cylinder_labels=memory.cylinder_labels,
    )
