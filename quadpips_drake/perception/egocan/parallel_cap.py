"""The floor cap in parallel projection: the remembered ground as seen from straight above."""

import numpy as np
from numba import njit


@njit(cache=True)
def draw_parallel_cap(
    ground_height, ground_normal, ground_label, first_cell, cell, X_WE, focal, pixel, height, normals, labels
):
    """Draws the remembered cells onto the floor cap, each pixel of side ``pixel`` [m] straight down.

    ``height`` comes filled with +inf and holds |y| where drawn, taken where the pixel's vertical meets the plane of its
    cell, so that a slope does not turn into a staircase. What lies outside the cone of the cap (``focal``, equation 4)
    belongs to the cylinder and stays unknown.
    """
    rows, columns = height.shape
    rim = 0.5 * columns / focal
    for row in range(rows):
        z = (row - rows // 2) * pixel
        for column in range(columns):
            x = (column - columns // 2) * pixel
            p0 = X_WE[0, 3] + X_WE[0, 0] * x + X_WE[0, 2] * z
            p1 = X_WE[1, 3] + X_WE[1, 0] * x + X_WE[1, 2] * z
            i, j = int(np.floor(p0 / cell)) - first_cell[0], int(np.floor(p1 / cell)) - first_cell[1]
            if i < 0 or j < 0 or i >= ground_height.shape[0] or j >= ground_height.shape[1]:
                continue
            y = X_WE[2, 3] - ground_height[i, j]
            if not y > 0.02:  # unknown, or not below the camera
                continue
            n0, n1, n2 = ground_normal[i, j, 0], ground_normal[i, j, 1], ground_normal[i, j, 2]
            if n2 > 0.5:
                y += (n0 * (p0 - (first_cell[0] + i + 0.5) * cell) + n1 * (p1 - (first_cell[1] + j + 0.5) * cell)) / n2
            if x * x + z * z > (rim * y) ** 2:
                continue
            height[row, column] = y
            normals[row, column, 0] = X_WE[0, 0] * n0 + X_WE[1, 0] * n1
            normals[row, column, 1] = -n2
            normals[row, column, 2] = X_WE[0, 2] * n0 + X_WE[1, 2] * n1
            labels[row, column] = ground_label[i, j]
