"""Moves the borders of labels to where surfaces end.

The network's borders are a pixel or two of its own (half as fine as the camera's) beside the edge, and mostly on the
cautious side: of the tops of stepping stones it calls up to 8 % non-passable, all at their rims. On small stones that is
ground to stand on.
"""

import numpy as np
from numba import njit

from quadpips_drake.values.sensing import CameraIntrinsics
from quadpips_drake.values.steppability import Steppability

REACH = 4
"""How far a border moves at most [pixels of the camera]: two pixels of the network."""
MIN_RUN = 16
"""Pixels in a row, away from the border, that the network must call steppable: thin strips, often mistakes, do not grow."""
_MAX_SLOPE = 0.5
"""Greatest rise over run between two pixels of one steppable surface: 27 deg; a vertical face has far more."""
_MAX_STEP = 0.02
"""Greatest difference of height between them [m]: the floor of a pit is further down."""
_STEPPABLE = int(Steppability.STEPPABLE)


def move_borders_to_edges(
    labels: np.ndarray, depth: np.ndarray, down_C: np.ndarray, intrinsics: CameraIntrinsics
) -> np.ndarray:
    """Returns ``labels`` in which pixels that continue a steppable surface beside them are steppable, too.

    Only pixels within REACH, along a row or a column, of MIN_RUN that the network itself calls steppable change, and only
    from passable or non-passable to steppable.

    Args:
        labels: Steppability, uint8 (height, width).
        depth: along the optical axis [m], (height, width); what has a label is valid.
        down_C: unit vector of gravity in the optical frame, (3,).
        intrinsics: of both.
    """
    k = intrinsics
    camera = np.array([k.fx, k.fy, k.cx, k.cy], np.float32)
    result = np.array(labels)
    _move(labels, np.ascontiguousarray(depth, np.float32), np.asarray(down_C, np.float32), camera, result)
    return result


@njit(cache=True, nogil=True)
def _move(labels, depth, down, camera, result):
    height, width = labels.shape
    for v in range(height):
        row, below = labels[v], labels[min(v + 1, height - 1)]
        for u in range(width):
            inside = row[u] == _STEPPABLE
            if u + 1 < width and (row[u + 1] == _STEPPABLE) != inside:
                if inside:
                    _grow(labels, depth, v, u, 0, 1, down, camera, result)
                else:
                    _grow(labels, depth, v, u + 1, 0, -1, down, camera, result)
            if (below[u] == _STEPPABLE) != inside:
                if inside:
                    _grow(labels, depth, v, u, 1, 0, down, camera, result)
                else:
                    _grow(labels, depth, v + 1, u, -1, 0, down, camera, result)


@njit(cache=True, nogil=True)
def _grow(labels, depth, i, j, dv, du, down, camera, result):
    """Makes steppable what lies beyond the border pixel (i, j) in the direction (dv, du) and continues its surface."""
    is_wide = False
    for step in range(1, REACH + 1):
        v, u = i + step * dv, j + step * du
        if not (0 <= v < labels.shape[0] and 0 <= u < labels.shape[1]) or labels[v, u] == _STEPPABLE:
            return
        if labels[v, u] > _STEPPABLE:
            is_wide = is_wide or _is_wide(labels, i, j, -dv, -du)
            if not is_wide:
                return
            if _continues(depth, v, u, i, j, down, camera):
                result[v, u] = _STEPPABLE


@njit(cache=True, nogil=True)
def _is_wide(labels, i, j, dv, du):
    """Whether MIN_RUN pixels from (i, j) on, in the direction (dv, du), are steppable; past the image counts as such."""
    for step in range(MIN_RUN):
        a, b = i + step * dv, j + step * du
        if not (0 <= a < labels.shape[0] and 0 <= b < labels.shape[1]):
            return True
        if labels[a, b] != _STEPPABLE:
            return False
    return True


@njit(cache=True, nogil=True)
def _continues(depth, v, u, i, j, down, camera):
    """Whether the way from pixel (i, j) to (v, u) is as level as steppable ground."""
    fx, fy, cx, cy = camera
    a, b = depth[v, u], depth[i, j]
    x = a * (u - cx) / fx - b * (j - cx) / fx
    y = a * (v - cy) / fy - b * (i - cy) / fy
    z = a - b
    fall = x * down[0] + y * down[1] + z * down[2]
    run = np.sqrt(max(x * x + y * y + z * z - fall * fall, 0.0))
    return abs(fall) <= _MAX_STEP and abs(fall) <= _MAX_SLOPE * run
