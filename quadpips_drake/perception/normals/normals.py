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


def estimate_normals(depth: np.ndarray, intrinsics: CameraIntrinsics, config: NormalConfig) -> np.ndarray:
    """Returns the normals of ``measure_surface`` alone."""
    return measure_surface(depth, intrinsics, config)[1]


def measure_surface(depth: np.ndarray, intrinsics: CameraIntrinsics, config: NormalConfig) -> tuple[np.ndarray, np.ndarray]:
    """Returns what a depth image says about the surface in view: its depth and the unit normal of each pixel.

    The depth, float32 (height, width) [m], is NaN where it is not finite or too near, and +inf where it is out of range. The
    normals, float32 (height, width, 3), are in the optical frame C, NaN where there is none.

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
    surface, normals = np.empty(depth.shape, np.float32), np.empty((*depth.shape, 3), np.float32)
    _measure(depth, limits, config.half_window, camera, surface, normals)
    return surface, normals


@njit(cache=True, nogil=True, error_model="numpy")
def _invert(depth, nearest, farthest, surface, w):
    """Writes one row of the cleaned depth and of the inverse depth (0 where invalid); returns how many pixels are valid."""
    count = 0
    for c in range(depth.shape[0]):
        z = depth[c]
        valid = (z >= nearest) & (z <= farthest)
        w[c] = np.float32(1.0) / z if valid else np.float32(0.0)
        surface[c] = z if valid else (np.float32(np.inf) if z > farthest else np.float32(np.nan))
        count += valid
    return count


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _join(w, before, jump, joined):
    """Writes 1 where a pixel continues the surface of the one ``before`` it (left of it or above it), else 0.

    |z1 - z0| <= jump, written in inverse depth; two invalid pixels join, which does no harm.
    """
    for c in range(joined.shape[0]):
        joined[c] = np.float32(1.0) if abs(w[c] - before[c]) <= jump * w[c] * before[c] else np.float32(0.0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _fit_three(second, third, row, a1, a2, a3, b1, b2, b3, ja1, ja2, ja3, jb1, jb2, jb3, sums):
    """Begins the sums of the fits for the pixels in ``row`` with the pixels up to three steps ahead (a) and behind (b).

    ``ja``, ``jb``: whether each step joins; ``second``, ``third``: 0 where windows end before that step, else 1.
    ``sums`` (7, columns): whether the window still runs on ahead and behind; then, over the pixels i in the window, the
    sums of 1, i, i^2, d and i d with d = w_i - w_0. Written so that the compiler can handle many columns at once.
    """
    one, two, three, four, nine = np.float32(1.0), np.float32(2.0), np.float32(3.0), np.float32(4.0), np.float32(9.0)
    for c in range(row.shape[0]):
        w, x1, y1 = row[c], ja1[c], jb1[c]
        x2, y2 = x1 * ja2[c] * second, y1 * jb2[c] * second
        x3, y3 = x2 * ja3[c] * third, y2 * jb3[c] * third
        dx1, dx2, dx3 = x1 * (a1[c] - w), x2 * (a2[c] - w), x3 * (a3[c] - w)
        dy1, dy2, dy3 = y1 * (b1[c] - w), y2 * (b2[c] - w), y3 * (b3[c] - w)
        sums[0, c], sums[1, c] = x3, y3
        sums[2, c] = one + (x1 + y1) + (x2 + y2) + (x3 + y3)
        sums[3, c] = (x1 - y1) + two * (x2 - y2) + three * (x3 - y3)
        sums[4, c] = (x1 + y1) + four * (x2 + y2) + nine * (x3 + y3)
        sums[5, c] = (dx1 + dy1) + (dx2 + dy2) + (dx3 + dy3)
        sums[6, c] = (dx1 - dy1) + two * (dx2 - dy2) + three * (dx3 - dy3)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _fit_further(k, row, ahead, behind, joined_ahead, joined_behind, sums):
    """Adds the pixels ``k`` steps to either side of those in ``row`` to the sums of their fits."""
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


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _normals_of_fits(row, along_u, along_v, camera, v, normals):
    """Writes the unit normals of image row ``v``, (3 columns,), from the sums of its fits; NaN where there is no slope.

    With a single pixel in a window, its slope is 0/0.
    """
    fx, fy, cx, cy = camera
    y_C = np.float32(v) - cy
    for c in range(row.shape[0]):
        spread_u = along_u[2, c] * along_u[4, c] - along_u[3, c] * along_u[3, c]
        spread_v = along_v[2, c] * along_v[4, c] - along_v[3, c] * along_v[3, c]
        w_u = (along_u[2, c] * along_u[6, c] - along_u[3, c] * along_u[5, c]) / spread_u
        w_v = (along_v[2, c] * along_v[6, c] - along_v[3, c] * along_v[5, c]) / spread_v
        x, y = fx * w_u, fy * w_v
        z = row[c] - (np.float32(c) - cx) * w_u - y_C * w_v
        scale = -np.float32(1.0) / np.sqrt(x * x + y * y + z * z)
        scale = scale if row[c] > 0 else np.float32(np.nan)
        normals[3 * c], normals[3 * c + 1], normals[3 * c + 2] = scale * x, scale * y, scale * z


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _measure(depth, limits, half_window, camera, surface, normals):
    """Cleans the depth and fits the slopes of inverse depth, row by row.

    Of inverse depth (``w``) and of what joins the row above (``joined_v``) only the rows that a window spans are kept, one
    after the other in a ring, with ``pad`` columns on each side that belong to nothing.
    """
    rows, columns = depth.shape
    nearest, farthest, jump = limits
    pad = max(half_window, 3)
    size = 2 * pad + 1
    left, right = pad, pad + columns
    w, joined_v = np.zeros((size, columns + 2 * pad), np.float32), np.zeros((size, columns), np.float32)
    joined_u = np.zeros(columns + 2 * pad, np.float32)
    valid = np.zeros(size, np.int64)
    along_u, along_v = np.empty((7, columns), np.float32), np.empty((7, columns), np.float32)
    second, third = np.float32(half_window >= 2), np.float32(half_window >= 3)
    for newest in range(rows + pad):
        n = newest % size
        if newest < rows:
            valid[n] = _invert(depth[newest], nearest, farthest, surface[newest], w[n, left:right])
        else:
            w[n, :] = np.float32(0.0)
        _join(w[n, left:right], w[(newest - 1) % size, left:right], jump, joined_v[n])
        v = newest - pad
        if v < 0:
            continue
        i = v % size
        if valid[i] == 0:
            normals[v, :, :] = np.float32(np.nan)
            continue
        row, middle = w[i], w[i, left:right]
        _join(row[1:], row[:-1], jump, joined_u[1:])
        _fit_three(
            second, third, middle, row[left + 1 :], row[left + 2 :], row[left + 3 :], row[left - 1 :], row[left - 2 :],
            row[left - 3 :], joined_u[left + 1 :], joined_u[left + 2 :], joined_u[left + 3 :], joined_u[left:],
            joined_u[left - 1 :], joined_u[left - 2 :], along_u,
        )  # fmt: skip
        a1, a2, a3 = (v + 1) % size, (v + 2) % size, (v + 3) % size
        b1, b2, b3 = (v - 1) % size, (v - 2) % size, (v - 3) % size
        _fit_three(
            second, third, middle, w[a1, left:], w[a2, left:], w[a3, left:], w[b1, left:], w[b2, left:], w[b3, left:],
            joined_v[a1], joined_v[a2], joined_v[a3], joined_v[i], joined_v[b1], joined_v[b2], along_v,
        )  # fmt: skip
        for k in range(4, half_window + 1):
            step, a, b = np.float32(k), (v + k) % size, (v - k) % size
            _fit_further(
                step, middle, row[left + k :], row[left - k :], joined_u[left + k :], joined_u[left - k + 1 :], along_u
            )
            _fit_further(step, middle, w[a, left:], w[b, left:], joined_v[a], joined_v[(b + 1) % size], along_v)
        _normals_of_fits(middle, along_u, along_v, camera, v, normals[v].reshape(-1))
