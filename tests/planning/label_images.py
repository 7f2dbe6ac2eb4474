"""Label images by hand: the ground from straight above, or as the front camera sees it."""

import numpy as np

from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.sensing import CameraIntrinsics

HEIGHT = 20.0
"""Of the camera [m]."""
CELL = 0.02
"""Size of a pixel on ground of height 0 [m]."""


def from_above(label_at, x_range=(-1.5, 4.0), y_range=(-1.5, 1.5)) -> LabelImage:
    """Returns an image of ``label_at(x, y)``, a function of arrays in W [m], over a rectangle."""
    columns, rows = (round((high - low) / CELL) for low, high in (x_range, y_range))
    focal = HEIGHT / CELL
    intrinsics = CameraIntrinsics(columns, rows, focal, focal, 0.5 * (columns - 1), 0.5 * (rows - 1))
    X_WC = np.diag([1.0, -1.0, -1.0, 1.0])
    X_WC[:3, 3] = np.mean(x_range), np.mean(y_range), HEIGHT
    u, v = np.meshgrid(np.arange(columns), np.arange(rows))
    x, y = X_WC[0, 3] + CELL * (u - intrinsics.cx), X_WC[1, 3] - CELL * (v - intrinsics.cy)
    labels = np.broadcast_to(label_at(x, y), x.shape).astype(np.uint8)
    return LabelImage(0.0, labels, np.full(labels.shape, HEIGHT, np.float32), X_WC, intrinsics)


_FRONT = CameraIntrinsics(640, 480, 348.0, 348.0, 319.5, 239.5)


def by_front_camera(terrain, robot, state, block=4) -> LabelImage:
    """Exact labels where the camera's rays meet the level of the feet, each for a square of ``block`` pixels."""
    X_WB = np.eye(4)
    X_WB[:3, :3], X_WB[:3, 3] = state.R_WB, state.p_WB
    X_WC = X_WB @ robot.camera().X_BC
    v, u = (block * k + 0.5 * (block - 1) for k in np.mgrid[: _FRONT.height // block, : _FRONT.width // block])
    rays_C = np.stack([(u - _FRONT.cx) / _FRONT.fx, (v - _FRONT.cy) / _FRONT.fy, np.ones(u.shape)], axis=-1)
    rays = rays_C @ X_WC[:3, :3].T
    level = robot.soles_W(robot.foot_positions_W(state))[:, 2].mean()
    with np.errstate(divide="ignore"):
        depth = (level - X_WC[2, 3]) / rays[..., 2]
    seen = (depth > 0.0) & (depth < 3.0)
    x, y = (X_WC[k, 3] + np.where(seen, depth, 0.0) * rays[..., k] for k in (0, 1))
    labels = np.where(seen, GroundTruth(terrain).label(x, y), 0).astype(np.uint8)
    labels, depth = (np.kron(a, np.ones((block, block), a.dtype)) for a in (labels, depth.astype(np.float32)))
    return LabelImage(state.stamp, labels, depth, X_WC, _FRONT)
