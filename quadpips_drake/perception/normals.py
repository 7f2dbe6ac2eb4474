"""Surface normals from the gradients of a depth image (QuadPiPS section V-A, equations 5-9)."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from quadpips_drake.errors import UserInputError
from quadpips_drake.sensing.camera_intrinsics import CameraIntrinsics


@dataclass
class NormalConfig:
    """Parameters of the normal estimation."""

    min_range: float = 0.1
    """Depth below which a pixel is invalid [m]."""
    max_range: float = 3.0
    """Depth above which a pixel is invalid [m]."""
    depth_jump: float = 0.07
    """Depth difference of neighbouring pixels above which they do not belong to one surface [m]."""
    half_window: int = 3
    """Pixels to each side over which a gradient is fitted; 1 is the least, more is smoother against noise [pixels]."""

    def __post_init__(self):
        if not 0 < self.min_range < self.max_range:
            raise UserInputError(f"normals: need 0 < min_range < max_range, got {self.min_range} and {self.max_range}")
        if self.depth_jump <= 0:
            raise UserInputError(f"normals: depth_jump must be positive, got {self.depth_jump}")
        if not 1 <= self.half_window <= 16:
            raise UserInputError(f"normals: half_window must be 1..16, got {self.half_window}")


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
    """
    depth = clean_depth(depth, config)
    inverse = np.nan_to_num(1.0 / depth, nan=0.0).astype(np.float32)
    normals = np.full((*depth.shape, 3), np.nan, np.float32)
    slope_u = _fit_slopes(inverse, config.half_window, np.float32(config.depth_jump))
    slope_v = _fit_slopes(np.ascontiguousarray(inverse.T), config.half_window, np.float32(config.depth_jump)).T
    _assemble_normals(inverse, slope_u, slope_v, intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy, normals)
    return normals


@njit(cache=True, fastmath={"contract", "arcp"})
def _fit_slopes(w, half_window, jump):
    """Returns the slope of ``w`` along each row by least squares over the connected part of the window; NaN where none."""
    rows, columns = w.shape
    slopes = np.full((rows, columns), np.nan, np.float32)
    run = np.empty(columns, np.int32)  # first column of the unbroken run that a pixel belongs to
    end = np.empty(columns, np.int32)  # and its last
    sum_w = np.zeros(columns + 1, np.float64)
    sum_iw = np.zeros(columns + 1, np.float64)
    for r in range(rows):
        for c in range(columns):
            joined = c > 0 and w[r, c] > 0 and w[r, c - 1] > 0
            # |z1 - z0| <= jump, written in inverse depth
            joined = joined and abs(w[r, c] - w[r, c - 1]) <= jump * w[r, c] * w[r, c - 1]
            run[c] = run[c - 1] if joined else c
            sum_w[c + 1] = sum_w[c] + w[r, c]
            sum_iw[c + 1] = sum_iw[c] + c * w[r, c]
        for c in range(columns - 1, -1, -1):
            end[c] = end[c + 1] if c + 1 < columns and run[c + 1] <= c else c
        for c in range(columns):
            if w[r, c] <= 0:
                continue
            first = max(run[c], c - half_window)
            last = min(end[c], c + half_window)
            n = last - first + 1
            if n < 2:
                continue
            mean = 0.5 * (first + last)
            moment = (sum_iw[last + 1] - sum_iw[first]) - mean * (sum_w[last + 1] - sum_w[first])
            slopes[r, c] = 12.0 * moment / (n * (n * n - 1.0))
    return slopes


@njit(cache=True)
def _assemble_normals(w, slope_u, slope_v, fx, fy, cx, cy, normals):
    rows, columns = w.shape
    for v in range(rows):
        for u in range(columns):
            w_u, w_v = slope_u[v, u], slope_v[v, u]
            if not (np.isfinite(w_u) and np.isfinite(w_v)):
                continue
            x = -fx * w_u
            y = -fy * w_v
            z = -(w[v, u] - (u - cx) * w_u - (v - cy) * w_v)
            length = np.sqrt(x * x + y * y + z * z)
            if length > 0:
                normals[v, u, 0] = x / length
                normals[v, u, 1] = y / length
                normals[v, u, 2] = z / length
