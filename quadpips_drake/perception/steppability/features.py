"""What the network sees: channels per pixel, made from a depth image and the direction of gravity."""

import math

import cv2
import numpy as np
from numba import njit

from quadpips_drake.values.sensing import CameraIntrinsics

WINDOWS = (5, 13)
"""Widths of the windows in which heights are compared, in blocks of pixels; odd."""
CHANNELS = (
    *("inverse_depth", "height", "normal_up", "normal_right", "normal_forward", "valid"),
    *(f"{name}_{width}" for width in WINDOWS for name in ("drop", "rise")),
)
"""Inverse depth [1/m]; height against the camera along gravity [m]; the normal in the gravity-aligned frame of the camera;
whether there is a measurement; and for each window how far the ground in it goes down and up from here [m], the height of
a discontinuity, which tells passable from non-passable. All but "valid" are zero where there is no measurement."""
MAX_DEPTH = 3.0
"""What is further away counts as not measured [m]."""
_BASELINE = 2
"""Pixels on either side over which normals are differenced: noise is smaller against a longer way."""
_BLOCK = 4
"""Edge of the blocks of pixels whose mean heights are compared: means have less noise than pixels."""
_MIN_SHARE = 0.25
"""Share of valid pixels under which a block has no height."""
_MAX_DIFFERENCE = 1.0
"""Differences of height are cut off here [m]: more says nothing more."""
_MAX_JUMP = 0.1
"""Relative difference of depth over which no normal is formed."""


def make_features(depth: np.ndarray, down_C: np.ndarray, intrinsics: CameraIntrinsics) -> np.ndarray:
    """Returns the network's input, float32 (len(CHANNELS), height, width).

    Args:
        depth: along the optical axis [m], (height, width); anything that is not in (0, MAX_DEPTH] is invalid.
        down_C: unit vector of gravity in the optical frame C, (3,).
        intrinsics: of ``depth``.
    """
    depth = np.ascontiguousarray(depth, np.float32)
    axes = _gravity_aligned_axes(np.asarray(down_C, float)).astype(np.float32)
    features = np.zeros((len(CHANNELS), *depth.shape), np.float32)
    k = intrinsics
    _fill(depth, axes, np.float32(k.fx), np.float32(k.fy), np.float32(k.cx), np.float32(k.cy), features)
    if depth.size:
        _compare_heights(features)
    return features


def scaled_intrinsics(intrinsics: CameraIntrinsics, step: int) -> CameraIntrinsics:
    """Returns the pinhole model of ``image[::step, ::step]``."""
    k = intrinsics
    size = (-(-k.width // step), -(-k.height // step))
    return CameraIntrinsics(*size, k.fx / step, k.fy / step, k.cx / step, k.cy / step)


def _gravity_aligned_axes(down_C: np.ndarray) -> np.ndarray:
    """Rows up, right, forward of the camera's gravity-aligned frame in C; right stays right of the image."""
    norm = np.linalg.norm(down_C)
    up = -down_C / norm if math.isfinite(norm) and norm > 1e-6 else np.array([0.0, -1.0, 0.0])
    forward = np.array([0.0, 0.0, 1.0])
    if abs(up @ forward) > 0.99:  # looking straight down or up: the top of the image is forward
        forward = np.array([0.0, -1.0, 0.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack([up, right, np.cross(up, right)])


def _compare_heights(features: np.ndarray) -> None:
    """Fills the channels of drops and rises from the heights: lowest and highest block around each pixel's own height."""
    blocks, known = _block_means(features[1], features[5])
    for k, width in enumerate(WINDOWS):
        kernel = np.ones((width, width), np.uint8)
        lowest = cv2.erode(np.where(known, blocks, np.float32(np.inf)), kernel)
        highest = cv2.dilate(np.where(known, blocks, np.float32(-np.inf)), kernel)
        _subtract(features[1], features[5], lowest, highest, features[6 + 2 * k], features[7 + 2 * k])


@njit(cache=True, nogil=True)
def _block_means(height, valid):
    """Returns the mean height of each block [m] and whether it has one."""
    rows, columns = -(-height.shape[0] // _BLOCK), -(-height.shape[1] // _BLOCK)
    total, count = np.zeros((rows, columns), np.float32), np.zeros((rows, columns), np.float32)
    for r in range(height.shape[0]):
        for c in range(height.shape[1]):
            total[r // _BLOCK, c // _BLOCK] += height[r, c] * valid[r, c]
            count[r // _BLOCK, c // _BLOCK] += valid[r, c]
    return total / np.maximum(count, np.float32(1)), count >= _MIN_SHARE * _BLOCK * _BLOCK


@njit(cache=True, nogil=True)
def _subtract(height, valid, lowest, highest, drop, rise):
    """Writes how far each pixel is above ``lowest`` and below ``highest`` of its block, 0 where nothing is known."""
    limit = np.float32(_MAX_DIFFERENCE)
    for r in range(height.shape[0]):
        for c in range(height.shape[1]):
            low, high = lowest[r // _BLOCK, c // _BLOCK], highest[r // _BLOCK, c // _BLOCK]
            if valid[r, c] > 0 and low <= high:
                drop[r, c] = min(max(height[r, c] - low, -limit), limit)
                rise[r, c] = min(max(high - height[r, c], -limit), limit)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill(depth, axes, fx, fy, cx, cy, features):
    """Writes the channels of single pixels and normals.

    A normal is the cross product of the steps between the points _BASELINE before and after a pixel along its column and its
    row; the pixel's own point stands for one that is not measured or beyond a jump. Selections instead of branches, float32
    throughout: so the compiler vectorises the rows.
    """
    height, width = depth.shape
    zero, one, least = np.float32(0), np.float32(1), np.float32(1e-12)
    up, right, forward = axes
    z = _with_border(depth)
    x = np.empty(width + 2 * _BASELINE, np.float32)
    for c in range(len(x)):
        x[c] = (np.float32(c - _BASELINE) - cx) / fx
    for r in range(height):
        y_e, y, y_g = (np.float32(r - _BASELINE) - cy) / fy, (np.float32(r) - cy) / fy, (np.float32(r + _BASELINE) - cy) / fy
        above, here, below = z[r], z[r + _BASELINE], z[r + 2 * _BASELINE]
        inverse, level, valid = features[0, r], features[1, r], features[5, r]
        upward, rightward, onward = features[2, r], features[3, r], features[4, r]
        for c in range(width):
            m, x_m = here[c + _BASELINE], x[c + _BASELINE]
            # Neighbours before, after (a, b) in the row, before, after (e, g) in the column.
            a, b, e, g = here[c], here[c + 2 * _BASELINE], above[c + _BASELINE], below[c + _BASELINE]
            has_a, has_b, has_e, has_g = _is_near(a, m), _is_near(b, m), _is_near(e, m), _is_near(g, m)
            a, x_a = (a if has_a else m), (x[c] if has_a else x_m)
            b, x_b = (b if has_b else m), (x[c + 2 * _BASELINE] if has_b else x_m)
            e, y_0 = (e if has_e else m), (y_e if has_e else y)
            g, y_1 = (g if has_g else m), (y_g if has_g else y)
            u0, u1, u2 = b * x_b - a * x_a, y * (b - a), b - a
            v0, v1, v2 = x_m * (g - e), g * y_1 - e * y_0, g - e
            n0, n1, n2 = v1 * u2 - v2 * u1, v2 * u0 - v0 * u2, v0 * u1 - v1 * u0
            norm = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
            scale = one / norm if (has_a | has_b) & (has_e | has_g) & (norm >= least) else zero
            inverse[c] = one / m if m > zero else zero
            level[c] = m * (up[0] * x_m + up[1] * y + up[2])
            upward[c] = scale * (up[0] * n0 + up[1] * n1 + up[2] * n2)
            rightward[c] = scale * (right[0] * n0 + right[1] * n1 + right[2] * n2)
            onward[c] = scale * (forward[0] * n0 + forward[1] * n1 + forward[2] * n2)
            valid[c] = one if m > zero else zero


@njit(cache=True, nogil=True)
def _with_border(depth):
    """Returns ``depth`` within a border of _BASELINE pixels; border and what is not measured are 0."""
    height, width = depth.shape
    far = np.float32(MAX_DEPTH)
    result = np.zeros((height + 2 * _BASELINE, width + 2 * _BASELINE), np.float32)
    for r in range(height):
        for c in range(width):
            z = depth[r, c]
            result[r + _BASELINE, c + _BASELINE] = z if (z > 0) & (z <= far) else np.float32(0)
    return result


@njit(cache=True, nogil=True)
def _is_near(z, middle):
    """Whether there is a depth ``z`` and no jump to the ``middle``; never where the middle is not measured."""
    return (z > 0) & (abs(z - middle) < np.float32(_MAX_JUMP) * middle)
