"""The ground that is assumed around the feet at the start (QuadPiPS section V-D.2), for memories of the ground."""

from collections.abc import Iterable

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.values.sensing import CameraIntrinsics


@configuration
class AssumedGroundConfig:
    """Where ground is assumed before it was seen."""

    assumed_behind: float = ranged(0.8, 0.0, 50.0)
    """Flat ground is assumed at the start from here behind the base origin [m] ..."""
    assumed_ahead: float = ranged(1.2, 0.0, 50.0)
    """... to here ahead of it, or to where the camera begins to see, whichever is nearer [m]."""
    assumed_half_width: float = ranged(0.5, 0.0, 50.0)
    """... and to this distance to either side [m]. Zero in all three: nothing is assumed."""


def assumed_plane(
    x: np.ndarray,
    y: np.ndarray,
    cameras: Iterable[tuple[np.ndarray, CameraIntrinsics]],
    X_WB: np.ndarray,
    p_WG: np.ndarray,
    config: AssumedGroundConfig,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the heights [m] of the plane through the feet at (x, y), its normal, and where it is to be believed (bool).

    Not in a camera's field of view, whether or not its image shows anything there. Feet that are nowhere (NaN) carry no
    assumption.

    Args:
        x, y: of the places in W [m], of shapes that broadcast.
        cameras: X_WC (4, 4) and intrinsics of each.
        X_WB: pose of the base, (4, 4).
        p_WG: ground points under the feet [m], (4, 3).
        config: of the assumption.
    """
    if not (np.isfinite(p_WG).all() and np.isfinite(X_WB).all()):
        shape = np.broadcast_shapes(x.shape, y.shape)
        return np.full(shape, np.nan), np.array([0.0, 0.0, 1.0]), np.zeros(shape, bool)
    center = p_WG.mean(axis=0)
    basis = np.column_stack([p_WG[:, 0] - center[0], p_WG[:, 1] - center[1]])
    slope, *_ = np.linalg.lstsq(basis, p_WG[:, 2] - center[2], rcond=None)
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope @ slope)
    z = center[2] + slope[0] * (x - center[0]) + slope[1] * (y - center[1])
    heading = X_WB[:2, 0] / np.linalg.norm(X_WB[:2, 0])
    ahead = heading[0] * (x - X_WB[0, 3]) + heading[1] * (y - X_WB[1, 3])
    aside = heading[0] * (y - X_WB[1, 3]) - heading[1] * (x - X_WB[0, 3])
    chosen = (ahead > -config.assumed_behind) & (ahead < config.assumed_ahead)
    chosen &= np.abs(aside) < config.assumed_half_width
    for X_WC, intrinsics in cameras:
        chosen &= ~_in_view(x, y, z, X_WC, intrinsics)
    return z, normal, chosen


def _in_view(x: np.ndarray, y: np.ndarray, z: np.ndarray, X_WC: np.ndarray, intrinsics: CameraIntrinsics) -> np.ndarray:
    """Whether the camera's field of view contains the points (x, y, z) of W [m]."""
    R_CW, p_WC, k = X_WC[:3, :3].T, X_WC[:3, 3], intrinsics
    d = (x - p_WC[0], y - p_WC[1], z - p_WC[2])
    p_C = [row[0] * d[0] + row[1] * d[1] + row[2] * d[2] for row in R_CW]
    front = p_C[2] > 1e-6
    depth = np.where(front, p_C[2], 1.0)
    u, v = k.fx * p_C[0] / depth + k.cx, k.fy * p_C[1] / depth + k.cy
    return front & (u >= 0) & (u <= k.width - 1) & (v >= 0) & (v <= k.height - 1)
