"""A stance foot does not move: its velocity is zero, but for a slow return to where it touched down (QuadPiPS eq. 19b)."""

from numba import njit

from quadpips_drake.trajectory.centroidal.centroidal_kernels import JOINT_RATES
from quadpips_drake.values.centroidal import STATE_SIZE
from quadpips_drake.values.legs import NUM_JOINTS


@njit(cache=True)
def stance_foot(p, v, p_ref, p_x, v_x, v_u, gain, row, by_state, by_rates, residual):
    """Writes three rows of  v + gain (p - p_ref) = 0, linearised: by_state dx + by_rates dv_j + residual = 0.

    Returns the next free row.
    """
    for i in range(3):
        residual[row + i] = v[i] + gain * (p[i] - p_ref[i])
        for j in range(STATE_SIZE):
            by_state[row + i, j] = v_x[i, j] + gain * p_x[i, j]
        for j in range(NUM_JOINTS):
            by_rates[row + i, j] = v_u[i, JOINT_RATES + j]
    return row + 3
