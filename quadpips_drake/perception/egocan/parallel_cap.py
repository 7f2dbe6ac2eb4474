"""The floor cap in parallel projection: the remembered ground as seen from straight above."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def _locate_pixels(row, X_WE, pixel, cell, first_cell, shape, p0, p1, cells):
    """Writes where the pixels of a row of the cap lie: x, y in W [m] and flat index of the cell, int32, -1 if in none.

    ``first_cell``, ``shape``: of the memory. Free of branches, so that the compiler can handle many pixels at once.
    """
    z = row * pixel
    start0, step0, aside0 = X_WE[0, 3], X_WE[0, 0], X_WE[0, 2] * z
    start1, step1, aside1 = X_WE[1, 3], X_WE[1, 0], X_WE[1, 2] * z
    middle = cells.shape[0] // 2
    for column in range(cells.shape[0]):
        x = (column - middle) * pixel
        p0[column], p1[column] = start0 + step0 * x + aside0, start1 + step1 * x + aside1
        i, j = np.floor(p0[column] / cell) - first_cell[0], np.floor(p1[column] / cell) - first_cell[1]
        inside = (i >= 0) & (j >= 0) & (i < shape[0]) & (j < shape[1])
        i, j = i if inside else 0.0, j if inside else 0.0
        cells[column] = np.int32(i) * np.int32(shape[1]) + np.int32(j) if inside else np.int32(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def draw_parallel_cap(ground, trusted_share, first_cell, cell, X_WE, focal, pixel, height, normals, labels):
    """Draws the remembered cells onto the floor cap, each pixel of side ``pixel`` [m] straight down.

    ``height`` gets |y|, taken where the pixel's vertical meets the plane of its cell, so that a slope does not turn into a
    staircase. What lies outside the cone of the cap (``focal``, equation 4) belongs to the cylinder and stays unknown.

    Args:
        ground: height, normal, label, count, missed of the memory.
        trusted_share: of GroundMemoryConfig; cells that were missed too often are left out.
    """
    rows, columns = height.shape
    rim = 0.5 * columns / focal
    ground_height, ground_normal, ground_label, count, missed = ground
    flat_height, flat_normal, flat_label = ground_height.ravel(), ground_normal.reshape(-1, 3), ground_label.ravel()
    flat_count, flat_missed = count.ravel(), missed.ravel()
    p0, p1, cells = np.empty(columns), np.empty(columns), np.empty(columns, np.int32)
    for row in range(rows):
        z = (row - rows // 2) * pixel
        _locate_pixels(row - rows // 2, X_WE, pixel, cell, first_cell, ground_height.shape, p0, p1, cells)
        for column in range(columns):
            height[row, column], labels[row, column] = np.nan, 0
            for k in range(3):
                normals[row, column, k] = np.nan
            if cells[column] < 0:
                continue
            c = np.uint32(cells[column])
            y = X_WE[2, 3] - flat_height[c]
            if not y > 0.02:  # unknown, or not below the camera
                continue
            if flat_count[c] < trusted_share * (flat_count[c] + flat_missed[c]):
                continue
            n0, n1, n2 = flat_normal[c, 0], flat_normal[c, 1], flat_normal[c, 2]
            if n2 > 0.5:
                middle0, middle1 = (np.floor(p0[column] / cell) + 0.5) * cell, (np.floor(p1[column] / cell) + 0.5) * cell
                y += (n0 * (p0[column] - middle0) + n1 * (p1[column] - middle1)) / n2
            x = (column - columns // 2) * pixel
            if x * x + z * z > (rim * y) ** 2:
                continue
            height[row, column] = y
            normals[row, column, 0] = X_WE[0, 0] * n0 + X_WE[1, 0] * n1
            normals[row, column, 1] = -n2
            normals[row, column, 2] = X_WE[0, 2] * n0 + X_WE[1, 2] * n1
            labels[row, column] = flat_label[c]
