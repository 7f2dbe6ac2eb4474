"""Removes the robot's own body from a depth image, from known kinematics and known shapes."""

import numpy as np
from numba import njit

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.robot_shapes import CYLINDER, load_robot_shapes
from quadpips_drake.values.sensing import CameraIntrinsics

_NEAR = 0.05
"""No camera measures a depth below this [m]."""


@configuration
class SelfFilterConfig:
    """How far from the robot's surface a measured point may lie and still be taken for the robot."""

    enabled: bool = True
    """Whether points on the robot itself are removed from the depth image."""
    margin: float = ranged(0.02, 0.0, 0.5)
    """Distance from the surface [m]."""
    margin_growth: float = ranged(0.0, 0.0, 0.5)
    """What the margin grows by with the squared depth, to allow for noise [1/m]."""


def blank_own_body(
    depth: np.ndarray,
    intrinsics: CameraIntrinsics,
    X_BC: np.ndarray,
    joint_positions: np.ndarray,
    robot: RobotModel,
    config: SelfFilterConfig,
) -> None:
    """Writes NaN to the pixels of ``depth`` [m], float32 (height, width), that show the robot itself.

    A pixel shows the robot when its point is closer to one of the robot's shapes (those that are drawn) than the margin.
    Only the rectangle of the image that a shape can cover is looked at.

    Args:
        X_BC: pose of the camera's optical frame in the base frame, (4, 4).
        joint_positions: [rad], (12,).
    """
    shapes = load_robot_shapes(robot)
    R_BL, p_BL = robot.link_poses_B(joint_positions)
    R_BL, p_BL = R_BL[shapes.link], p_BL[shapes.link]
    R_CB = X_BC[:3, :3].T
    R_GC = np.ascontiguousarray((R_CB @ R_BL @ shapes.R_LG).transpose(0, 2, 1))
    p_BG = p_BL + np.einsum("nij,nj->ni", R_BL, shapes.p_LG)
    p_CG = (p_BG - X_BC[:3, 3]) @ R_CB.T
    pinhole = (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy)
    margins = (config.margin, config.margin_growth)
    _blank_shapes(depth, pinhole, R_GC, p_CG, shapes.kind, shapes.half_size, shapes.rounding, margins)


@njit(cache=True, nogil=True)
def _blank_shapes(depth, pinhole, R_GC, p_CG, kind, half_size, rounding, margins):
    """Writes NaN where a pixel's point is within the margin of any shape."""
    margin, growth = margins
    for i in range(len(kind)):
        radius = np.sqrt(np.sum(half_size[i] ** 2)) + rounding[i]
        # Neither the shape nor the points that could be taken for it lie deeper than this.
        deepest = max(p_CG[i, 2] + radius + margin, 0.0)
        extent = half_size[i] + (rounding[i] + margin + growth * deepest * deepest)
        window = _covered_window(R_GC[i], p_CG[i], extent, pinhole, depth.shape)
        shape = (kind[i] == CYLINDER, half_size[i, 0], half_size[i, 1], half_size[i, 2], rounding[i], radius)
        _blank_window(depth, window, pinhole, R_GC[i], p_CG[i], shape, margins)


@njit(cache=True, nogil=True)
def _covered_window(R_GC, p_CG, extent, pinhole, image_shape):
    """Returns first and past-the-last row and column of the pixels behind which a box of half ``extent`` can lie.

    The bounds are those of its corners and of the points where its edges cross the plane z = _NEAR, before which nothing is.
    """
    fx, fy, cx, cy = pinhole
    height, width = image_shape
    corners = np.empty((8, 3))
    for c in range(8):
        corners[c] = p_CG
        for axis in range(3):
            corners[c] += (extent[axis] if (c >> axis) & 1 else -extent[axis]) * R_GC[axis]
    u_low, u_high, v_low, v_high = np.inf, -np.inf, np.inf, -np.inf
    for c in range(8):
        for axis in range(-1, 3):
            a = corners[c]
            x, y, z = a[0], a[1], a[2]
            if axis >= 0:
                b = corners[c ^ (1 << axis)]
                if not (z < _NEAR < b[2]):
                    continue
                t = (_NEAR - z) / (b[2] - z)
                x, y, z = x + t * (b[0] - x), y + t * (b[1] - y), _NEAR
            elif z < _NEAR:
                continue
            u, v = fx * x / z + cx, fy * y / z + cy
            u_low, u_high, v_low, v_high = min(u_low, u), max(u_high, u), min(v_low, v), max(v_high, v)
    if u_low > u_high:
        return 0, 0, 0, 0
    # Clamped as floats first: close to the camera's plane these are very large numbers.
    top, bottom = min(max(v_low, 0.0), height), min(max(v_high + 1.0, 0.0), height)
    left, right = min(max(u_low, 0.0), width), min(max(u_high + 1.0, 0.0), width)
    return int(top), int(np.ceil(bottom)), int(left), int(np.ceil(right))


@njit(cache=True, nogil=True)
def _blank_window(depth, window, pinhole, R_GC, p_CG, shape, margins):
    """Writes NaN to the pixels in ``window`` whose points are within the margin of one shape."""
    fx, fy, cx, cy = pinhole
    is_cylinder, half_x, half_y, half_z, rounding, radius = shape
    margin, growth = margins
    for v in range(window[0], window[1]):
        slope_y = (v - cy) / fy
        for u in range(window[2], window[3]):
            z = np.float64(depth[v, u])
            if not 0.0 < z < np.inf:
                continue
            reach = margin + growth * z * z
            # Most pixels of the window lie far behind the shape.
            if abs(z - p_CG[2]) > radius + reach:
                continue
            x, y, z = z * (u - cx) / fx - p_CG[0], z * slope_y - p_CG[1], z - p_CG[2]
            gx = abs(R_GC[0, 0] * x + R_GC[0, 1] * y + R_GC[0, 2] * z)
            gy = abs(R_GC[1, 0] * x + R_GC[1, 1] * y + R_GC[1, 2] * z)
            gz = max(abs(R_GC[2, 0] * x + R_GC[2, 1] * y + R_GC[2, 2] * z) - half_z, 0.0)
            if is_cylinder:
                gx, gy = max(np.sqrt(gx * gx + gy * gy) - half_x, 0.0), 0.0
            else:
                gx, gy = max(gx - half_x, 0.0), max(gy - half_y, 0.0)
            reach += rounding
            if gx * gx + gy * gy + gz * gz <= reach * reach:
                depth[v, u] = np.nan
