"""Surface normals from the gradients of a depth image (QuadPiPS section V-A, equations 5-9)."""

import numpy as np
from numba import njit

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import OnDemandStageConfig
from quadpips_drake.values.sensing import CameraIntrinsics


@configuration
class NormalConfig(OnDemandStageConfig):
    """Parameters of the normal estimation."""

    min_range: float = ranged(0.1, 0.001, 100.0)
    """Depth below which a pixel is invalid [m]."""
    max_range: float = ranged(3.0, 0.01, 100.0)
    """Depth above which a pixel is invalid [m]."""
    depth_jump: float = ranged(0.07, 0.001, 10.0)
    """Depth difference of neighbouring pixels above which they do not belong to one surface [m]."""
    half_window: int = ranged(3, 1, 16)
    """Pixels to each side over which a gradient is fitted; 1 is the least, more is smoother against noise [pixels]."""

    def __post_init__(self):
        super().__post_init__()
        if not self.min_range < self.max_range:
            raise UserInputError(f"min_range must be below max_range, {self.max_range:g} m, not {self.min_range:g} m")


def clean_depth(depth: np.ndarray, config: NormalConfig) -> np.ndarray:
    """Returns ``depth`` [m] as float32 with NaN wherever it is not finite or out of range."""
    depth = np.asarray(depth, np.float32)
    with np.errstate(invalid="ignore"):
        valid = (depth >= config.min_range) & (depth <= config.max_range)
    return np.where(valid, depth, np.float32(np.nan))


def estimate_normals(depth: np.ndarray, intrinsics: CameraIntrinsics, config: NormalConfig) -> np.ndarray:
    """Returns the unit normal of each pixel in the optical frame C, float32 (height, width, 3), NaN where there is none.

    The gradients of depth z are taken through the inverse depth w = 1/z, because w of a plane is exactly linear in the
    pixel coordinates: z_u = -z^2 w_u. With that, the cross product p_v x p_u of equations 5-8 becomes, up to a positive
    factor, n = -(f_x w_u, f_y w_v, w - (u - u0) w_u - (v - v0) w_v), which points towards the camera. The gradient is a
    least-squares fit over up to ``half_window`` pixels on either side, ended by the first depth jump or invalid pixel.

    Args:
        depth: [m], (height, width); what is not finite or out of range has no normal and ends the fits around it.
    """
    depth = np.ascontiguousarray(depth, np.float32)
    limits = np.array([config.min_range, config.max_range, config.depth_jump], np.float32)
    k = intrinsics
    camera = np.array([k.fx, k.fy, k.cx, k.cy], np.float32)
    normals = np.empty((*depth.shape, 3), np.float32)
    _estimate(depth, limits, config.half_window, camera, normals)
    return normals


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _invert(depth, limits, pad, w, joined_u, joined_v):
    """Writes inverse depth (0 where invalid) and whether a pixel continues the surface of the one left of and above it.

    All three have ``pad`` more pixels on each side, which belong to nothing.
    """
    rows, columns = depth.shape
    nearest, farthest, jump = limits
    zero, one = np.float32(0.0), np.float32(1.0)
    for v in range(rows):
        r = v + pad
        for u in range(columns):
            z = depth[v, u]
            w[r, u + pad] = one / z if (z >= nearest) & (z <= farthest) else zero
        for u in range(columns):
            a, left, above = w[r, u + pad], w[r, u + pad - 1], w[r - 1, u + pad]
            # |z1 - z0| <= jump, written in inverse depth; two invalid pixels join, which does no harm
            joined_u[r, u + pad] = one if abs(a - left) <= jump * a * left else zero
            joined_v[r, u + pad] = one if abs(a - above) <= jump * a * above else zero


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def _accumulate(k, row, ahead, behind, joined_ahead, joined_behind, sums):
    """Adds the pixels ``k`` steps to either side of those in ``row`` to the sums of their fits.

    ``sums`` (7, columns): whether the window still runs on ahead and behind; then, over the pixels i in the window, the
    sums of 1, i, i^2, d and i d with d = w_i - w_0. Written so that the compiler can handle many columns at once.
    """
    k2 = k * k
    for c in range(row.shape[0]):
        a, b = sums[0, c] * joined_ahead[c], sums[1, c] * joined_behind[c]
        da, db = a * (ahead[c] - row[c]), b * (behind[c] - row[c])
        sums[0, c], sums[1, c] = a, b
        sums[2, c] += a + b
        sums[3, c] += k * (a - b)
        sums[4, c] += k2 * (a + b)
        sums[5, c] += da + db
        sums[6, c] += k * (da - db)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _estimate(depth, limits, half_window, camera, normals):
    """Fits the slopes of inverse depth row by row and writes the unit normals."""
    rows, columns = depth.shape
    pad = half_window
    fx, fy, cx, cy = camera
    w, joined_u, joined_v = np.zeros((3, rows + 2 * pad, columns + 2 * pad), np.float32)
    _invert(depth, limits, pad, w, joined_u, joined_v)
    along_u, along_v = np.empty((7, columns), np.float32), np.empty((7, columns), np.float32)
    unit = np.empty((3, columns), np.float32)
    nothing = np.float32(np.nan)
    left, right = pad, pad + columns
    for v in range(rows):
        r = v + pad
        row = w[r, left:right]
        for sums in (along_u, along_v):
            sums[:3] = np.float32(1.0)
            sums[3:] = np.float32(0.0)
        for i in range(1, half_window + 1):
            k = np.float32(i)
            ahead, behind = w[r, left + i : right + i], w[r, left - i : right - i]
            joined = joined_u[r, left - i + 1 :]
            _accumulate(k, row, ahead, behind, joined_u[r, left + i :], joined, along_u)
            ahead, behind = w[r + i, left:right], w[r - i, left:right]
            _accumulate(k, row, ahead, behind, joined_v[r + i, left:], joined_v[r - i + 1, left:], along_v)
        y_C = np.float32(v) - cy
        for c in range(columns):
            spread_u = along_u[2, c] * along_u[4, c] - along_u[3, c] * along_u[3, c]
            spread_v = along_v[2, c] * along_v[4, c] - along_v[3, c] * along_v[3, c]
            w_u = (along_u[2, c] * along_u[6, c] - along_u[3, c] * along_u[5, c]) / spread_u
            w_v = (along_v[2, c] * along_v[6, c] - along_v[3, c] * along_v[5, c]) / spread_v
            x, y = fx * w_u, fy * w_v
            z = row[c] - (np.float32(c) - cx) * w_u - y_C * w_v
            scale = -np.float32(1.0) / np.sqrt(x * x + y * y + z * z)
            # With a single pixel in a window there is no spread, and no slope.
            scale = scale if (row[c] > 0) & (spread_u > 0) & (spread_v > 0) else nothing
            unit[0, c], unit[1, c], unit[2, c] = scale * x, scale * y, scale * z
        for c in range(columns):
            normals[v, c, 0], normals[v, c, 1], normals[v, c, 2] = unit[0, c], unit[1, c], unit[2, c]
