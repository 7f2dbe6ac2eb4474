"""Removes the robot's own legs from a depth image, from known kinematics and known shapes."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.images import CameraIntrinsics
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.leg_shapes import CYLINDER, load_leg_shapes

_NEAR = 0.01
"""A shape that reaches closer to the camera's plane than this [m] may cover any pixel."""


@dataclass
class SelfFilterConfig:
    """How far from the legs' surfaces a measured point may lie and still be taken for a leg."""

    enabled: bool = True
    margin: float = 0.02
    """Distance from the surface [m]."""
    margin_growth: float = 0.0
    """What the margin grows by with the squared depth, to allow for noise [1/m]."""

    def __post_init__(self):
        if not 0.0 <= self.margin <= 0.5:
            raise UserInputError(f"self_filter: margin must be 0..0.5 m, got {self.margin}")
        if not 0.0 <= self.margin_growth <= 0.5:
            raise UserInputError(f"self_filter: margin_growth must be 0..0.5 1/m, got {self.margin_growth}")


def find_own_legs(
    depth: np.ndarray,
    intrinsics: CameraIntrinsics,
    X_BC: np.ndarray,
    joint_positions: np.ndarray,
    robot: RobotModel,
    config: SelfFilterConfig,
) -> np.ndarray:
    """Returns which pixels of ``depth`` [m], float32 (height, width), lie on the robot's legs, bool (height, width).

    A pixel belongs to a leg when its point is closer to one of the leg's shapes (those that are drawn) than the margin.
    Only the rectangle of the image that a shape can cover is looked at.

    Args:
        X_BC: pose of the camera's optical frame in the base frame, (4, 4).
        joint_positions: [rad], (12,).
    """
    shapes = load_leg_shapes(robot)
    R_BL, p_BL = robot.link_poses_B(joint_positions)
    R_BL, p_BL = R_BL[shapes.link], p_BL[shapes.link]
    R_CB = X_BC[:3, :3].T
    R_GC = np.ascontiguousarray((R_CB @ R_BL @ shapes.R_LG).transpose(0, 2, 1))
    p_BG = p_BL + np.einsum("nij,nj->ni", R_BL, shapes.p_LG)
    p_CG = (p_BG - X_BC[:3, 3]) @ R_CB.T
    mask = np.zeros(depth.shape, dtype=np.bool_)
    pinhole = (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy)
    growth = config.margin_growth
    for i in range(len(shapes.kind)):
        # The shape is nowhere deeper than this, so neither are the points that could be taken for it.
        deepest = p_CG[i, 2] + np.linalg.norm(shapes.half_size[i]) + shapes.rounding[i] + config.margin
        extent = shapes.half_size[i] + shapes.rounding[i] + config.margin + growth * max(deepest, 0.0) ** 2
        window = _covered_window(R_GC[i], p_CG[i], extent, pinhole, depth.shape)
        shape = (shapes.kind[i], shapes.half_size[i], shapes.rounding[i])
        _mark_window(depth, mask, window, pinhole, R_GC[i], p_CG[i], shape, config.margin, growth)
    return mask


@njit(cache=True)
def _covered_window(R_GC, p_CG, extent, pinhole, image_shape):
    """Returns first and past-the-last row and column of the pixels behind which a box of half ``extent`` can lie."""
    fx, fy, cx, cy = pinhole
    height, width = image_shape
    u_low, u_high, v_low, v_high = np.inf, -np.inf, np.inf, -np.inf
    nearest, farthest = np.inf, -np.inf
    for corner in range(8):
        p_C = p_CG.copy()
        for axis in range(3):
            sign = 1.0 if (corner >> axis) & 1 else -1.0
            p_C += sign * extent[axis] * R_GC[axis]
        nearest, farthest = min(nearest, p_C[2]), max(farthest, p_C[2])
        if p_C[2] > _NEAR:
            u, v = fx * p_C[0] / p_C[2] + cx, fy * p_C[1] / p_C[2] + cy
            u_low, u_high, v_low, v_high = min(u_low, u), max(u_high, u), min(v_low, v), max(v_high, v)
    if farthest <= _NEAR:
        return 0, 0, 0, 0
    if nearest <= _NEAR:
        return 0, height, 0, width
    # Clamped as floats first: a shape near the camera's plane projects to very large numbers.
    top = int(np.floor(min(max(v_low, 0.0), height)))
    bottom = int(np.ceil(min(max(v_high + 1.0, 0.0), height)))
    left = int(np.floor(min(max(u_low, 0.0), width)))
    right = int(np.ceil(min(max(u_high + 1.0, 0.0), width)))
    return top, bottom, left, right


@njit(cache=True)
def _mark_window(depth, mask, window, pinhole, R_GC, p_CG, shape, margin, growth):
    """Sets ``mask`` for the pixels in ``window`` whose points are within the margin of one shape."""
    fx, fy, cx, cy = pinhole
    kind, half, rounding = shape
    for v in range(window[0], window[1]):
        for u in range(window[2], window[3]):
            z = np.float64(depth[v, u])
            if mask[v, u] or not 0.0 < z < np.inf:
                continue
            x, y, z0 = z * (u - cx) / fx - p_CG[0], z * (v - cy) / fy - p_CG[1], z - p_CG[2]
            gx = abs(R_GC[0, 0] * x + R_GC[0, 1] * y + R_GC[0, 2] * z0)
            gy = abs(R_GC[1, 0] * x + R_GC[1, 1] * y + R_GC[1, 2] * z0)
            gz = max(abs(R_GC[2, 0] * x + R_GC[2, 1] * y + R_GC[2, 2] * z0) - half[2], 0.0)
            if kind == CYLINDER:
                gx, gy = max(np.sqrt(gx * gx + gy * gy) - half[0], 0.0), 0.0
            else:
                gx, gy = max(gx - half[0], 0.0), max(gy - half[1], 0.0)
            reach = rounding + margin + growth * z * z
            mask[v, u] = gx * gx + gy * gy + gz * gz <= reach * reach
