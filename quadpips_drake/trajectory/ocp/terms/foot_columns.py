"""Which variables move a foot."""

import numpy as np
from numba import njit

from quadpips_drake.trajectory.centroidal.centroidal_kernels import JOINTS, POSITION


@njit(cache=True)
def foot_columns(leg):
    """The entries of the state on which a foot's position depends: pose of the base, the leg's joints, (9,)."""
    columns = np.empty(9, np.int64)
    for i in range(6):
        columns[i] = POSITION + i
    for i in range(3):
        columns[6 + i] = JOINTS + 3 * leg + i
    return columns
