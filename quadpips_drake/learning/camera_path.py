"""How the camera moves through a scene (QuadPiPS section V-B.4)."""

import math

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import pose


@configuration
class CameraPathConfig:
    """Walking and its shaking."""

    stride_min: float = ranged(0.10, 0.0, 10.0)
    """Least way between two frames [m]."""
    stride_max: float = ranged(0.40, 0.0, 10.0)
    """Longest way between two frames [m]."""
    turn: float = ranged(0.12, 0.0, 3.2)
    """Standard deviation of the turn between two frames [rad]."""
    jitter_position: float = ranged(0.02, 0.0, 1.0)
    """Standard deviation of the base about its nominal position, along each axis [m]."""
    jitter_angle: float = ranged(0.04, 0.0, 1.0)
    """Standard deviation of the base about its nominal attitude, about each axis [rad]."""

    def __post_init__(self):
        if self.stride_min > self.stride_max:
            raise UserInputError(f"stride_min must be at most stride_max, {self.stride_max:g} m, not {self.stride_min:g} m")


def camera_poses(
    robot: RobotModel,
    X_BC: np.ndarray,
    start: tuple[float, float, float],
    ground: np.ndarray,
    frames: int,
    rng: np.random.Generator,
    config: CameraPathConfig,
) -> list[np.ndarray]:
    """Returns ``frames`` poses X_WC (4, 4) of a camera mounted at ``X_BC`` on ``robot``, which walks over ``ground``.

    The base keeps its nominal height over the ground under its feet and leans with it; then comes Gaussian jitter in all
    six degrees of freedom.

    Args:
        start: x, y [m], yaw [rad] of the base.
        ground: triangles that carry feet, (n, 3, 3) in W [m].
    """
    x, y, yaw = start
    poses = []
    for _ in range(frames):
        height, roll, pitch = _lean(robot, ground, x, y, yaw)
        xyz = np.array([x, y, height + robot.nominal_base_height]) + config.jitter_position * rng.standard_normal(3)
        rpy = np.array([roll, pitch, yaw]) + config.jitter_angle * rng.standard_normal(3)
        poses.append(pose(xyz, rpy) @ X_BC)
        yaw += config.turn * rng.standard_normal()
        stride = rng.uniform(config.stride_min, config.stride_max)
        x, y = x + stride * math.cos(yaw), y + stride * math.sin(yaw)
    return poses


def _lean(robot: RobotModel, ground: np.ndarray, x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """Height [m], roll and pitch [rad] of the ground under the four feet; level where feet find none."""
    feet = robot.nominal_footholds_B[:, :2]
    at = feet @ yaw_matrix(yaw)[:2, :2].T + [x, y]
    heights = heights_below(ground, at)
    if not np.any(np.isfinite(heights)):
        return 0.0, 0.0, 0.0
    heights = np.where(np.isfinite(heights), heights, np.nanmean(heights))
    left_front, right_front, left_hind, right_hind = heights
    length, width = np.ptp(feet[:, 0]), np.ptp(feet[:, 1])
    pitch = math.atan2(0.5 * (left_hind + right_hind - left_front - right_front), length)
    roll = math.atan2(0.5 * (left_front + left_hind - right_front - right_hind), width)
    return float(heights.mean()), float(np.clip(roll, -0.4, 0.4)), float(np.clip(pitch, -0.5, 0.5))


def heights_below(triangles: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Returns the height of the highest of ``triangles`` (n, 3, 3) over each point ``xy`` (m, 2) [m]; NaN where none is."""
    heights = np.full(len(xy), np.nan)
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    e1, e2 = b - a, c - a
    area = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    flat = np.abs(area) > 1e-9
    a, e1, e2, area = a[flat], e1[flat], e2[flat], area[flat]
    for i, point in enumerate(xy):
        d = point - a[:, :2]
        u = (d[:, 0] * e2[:, 1] - d[:, 1] * e2[:, 0]) / area
        v = (e1[:, 0] * d[:, 1] - e1[:, 1] * d[:, 0]) / area
        inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
        if inside.any():
            heights[i] = (a[inside, 2] + u[inside] * e1[inside, 2] + v[inside] * e2[inside, 2]).max()
    return heights
