"""Windows of cells that are fixed to the world and travel with the robot in whole cells."""

import numpy as np


def shifted(old: np.ndarray, down: int, right: int) -> np.ndarray:
    """Returns a fresh array whose element (i, j) is ``old``'s (i + down, j + right); unknown where ``old`` has none.

    Unknown is NaN in arrays of float32, else 0.
    """
    n, nothing = len(old), np.nan if old.dtype == np.float32 else 0
    if max(abs(down), abs(right)) >= n:
        return np.full(old.shape, nothing, old.dtype)
    fresh = np.empty(old.shape, old.dtype)
    top, bottom, left, end = max(-down, 0), n - max(down, 0), max(-right, 0), n - max(right, 0)
    fresh[top:bottom, left:end] = old[top + down : bottom + down, left + right : end + right]
    fresh[:top], fresh[bottom:] = nothing, nothing
    fresh[:, :left], fresh[:, end:] = nothing, nothing
    return fresh
