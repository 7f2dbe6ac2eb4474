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


@njit(cache=True)
def _block_means(height, valid):
    """Returns the mean height of each block [m] and whether it has one."""
    rows, columns = -(-height.shape[0] // _BLOCK), -(-height.shape[1] // _BLOCK)
    total, count = np.zeros((rows, columns), np.float32), np.zeros((rows, columns), np.float32)
    for r in range(height.shape[0]):
        for c in range(height.shape[1]):
            total[r // _BLOCK, c // _BLOCK] += height[r, c] * valid[r, c]
            count[r // _BLOCK, c // _BLOCK] += valid[r, c]
    return total / np.maximum(count, np.float32(1)), count >= _MIN_SHARE * _BLOCK * _BLOCK


@njit(cache=True)
def _subtract(height, valid, lowest, highest, drop, rise):
    """Writes how far each pixel is above ``lowest`` and below ``highest`` of its block, 0 where nothing is known."""
    limit = np.float32(_MAX_DIFFERENCE)
    for r in range(height.shape[0]):
        for c in range(height.shape[1]):
            low, high = lowest[r // _BLOCK, c // _BLOCK], highest[r // _BLOCK, c // _BLOCK]
            if valid[r, c] > 0 and low <= high:
                drop[r, c] = min(max(height[r, c] - low, -limit), limit)
                rise[r, c] = min(max(high - height[r, c], -limit), limit)


@njit(cache=True)
def _is_valid(z):
    return z > 0.0 and z <= MAX_DEPTH


@njit(cache=True)
def _fill(depth, axes, fx, fy, cx, cy, features):
    height, width = depth.shape
    normal = np.zeros(3, np.float32)
    for r in range(height):
        y = (r - cy) / fy
        for c in range(width):
            z = depth[r, c]
            if not _is_valid(z):
                continue
            x = (c - cx) / fx
            features[0, r, c] = 1.0 / z
            features[1, r, c] = z * (axes[0, 0] * x + axes[0, 1] * y + axes[0, 2])
            features[5, r, c] = 1.0
            if _normal(depth, r, c, fx, fy, cx, cy, normal):
                for k in range(3):
                    features[2 + k, r, c] = axes[k, 0] * normal[0] + axes[k, 1] * normal[1] + axes[k, 2] * normal[2]


@njit(cache=True)
def _difference(depth, r, c, dr, dc, fx, fy, cx, cy, out):
    """Writes the 3-D step between the valid pixels before and after (r, c) along (dr, dc); False if there are none."""
    height, width = depth.shape
    z = depth[r, c]
    r0, c0, r1, c1 = r, c, r, c
    for sign in (-1, 1):
        i, j = r + sign * dr, c + sign * dc
        if 0 <= i < height and 0 <= j < width and _is_valid(depth[i, j]) and abs(depth[i, j] - z) < _MAX_JUMP * z:
            if sign < 0:
                r0, c0 = i, j
            else:
                r1, c1 = i, j
    if r0 == r1 and c0 == c1:
        return False
    z0, z1 = depth[r0, c0], depth[r1, c1]
    out[0] = z1 * (c1 - cx) / fx - z0 * (c0 - cx) / fx
    out[1] = z1 * (r1 - cy) / fy - z0 * (r0 - cy) / fy
    out[2] = z1 - z0
    return True


@njit(cache=True)
def _normal(depth, r, c, fx, fy, cx, cy, normal):
    """Writes the unit normal, towards the camera; False (and nothing written) if it cannot be formed."""
    u, v = np.empty(3, np.float32), np.empty(3, np.float32)
    if not _difference(depth, r, c, 0, _BASELINE, fx, fy, cx, cy, u):
        return False
    if not _difference(depth, r, c, _BASELINE, 0, fx, fy, cx, cy, v):
        return False
    n0 = v[1] * u[2] - v[2] * u[1]
    n1 = v[2] * u[0] - v[0] * u[2]
    n2 = v[0] * u[1] - v[1] * u[0]
    norm = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    if norm < 1e-12:
        return False
    normal[0], normal[1], normal[2] = n0 / norm, n1 / norm, n2 / norm
    return True
