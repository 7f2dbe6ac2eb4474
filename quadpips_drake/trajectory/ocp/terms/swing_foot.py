"""A swinging foot follows its spline along the surface normal (or in all directions)."""

from numba import njit

from quadpips_drake.trajectory.centroidal.centroidal_kernels import JOINT_RATES


@njit(cache=True)
def swing_foot(p, v, p_ref, v_ref, normal, p_x, v_x, v_u, gain, row, by_state, by_rates, residual):
    """Writes one row of  n . (v - v_ref + gain (p - p_ref)) = 0, linearised. Returns the next free row."""
    residual[row] = 0.0
    by_state[row, :] = 0.0
    by_rates[row, :] = 0.0
    for i in range(3):
        residual[row] += normal[i] * (v[i] - v_ref[i] + gain * (p[i] - p_ref[i]))
        by_state[row, :] += normal[i] * (v_x[i] + gain * p_x[i])
        by_rates[row, :] += normal[i] * v_u[i, JOINT_RATES:]
    return row + 1
