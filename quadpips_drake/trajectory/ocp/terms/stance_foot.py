"""A stance foot does not move: its velocity is zero, but for a slow return to where it touched down (QuadPiPS eq. 19b)."""

from numba import njit

from quadpips_drake.trajectory.centroidal.centroidal_kernels import JOINT_RATES


@njit(cache=True)
def stance_foot(p, v, p_ref, p_x, v_x, v_u, gain, row, by_state, by_rates, residual):
    """Writes three rows of  v + gain (p - p_ref) = 0, linearised: by_state dx + by_rates dv_j + residual = 0.

    Returns the next free row.
    """
    for i in range(3):
        residual[row + i] = v[i] + gain * (p[i] - p_ref[i])
        by_state[row + i, :] = v_x[i] + gain * p_x[i]
        by_rates[row + i, :] = v_u[i, JOINT_RATES:]
    return row + 3
