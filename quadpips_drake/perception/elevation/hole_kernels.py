"""The inner loop of inpainting."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def lowest_borders(height, labels, count):
    """Returns the lowest height [m] around each hole, float32 (count,); NaN where a hole has no border.

    ``labels``: the hole of each cell, int32 (n, m), 0 where the height is known.
    """
    lowest = np.full(count, np.float32(np.nan))
    rows, columns = labels.shape
    for i in range(rows):
        for j in range(columns):
            hole = labels[i, j]
            if hole == 0:
                continue
            for a in range(max(i - 1, 0), min(i + 2, rows)):
                for b in range(max(j - 1, 0), min(j + 2, columns)):
                    if labels[a, b] == 0 and not height[a, b] >= lowest[hole]:
                        lowest[hole] = height[a, b]
    return lowest
