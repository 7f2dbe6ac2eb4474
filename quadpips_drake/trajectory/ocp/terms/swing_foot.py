"""A swinging foot follows its spline along the surface normal (or in all directions)."""

from numba import njit

from quadpips_drake.trajectory.centroidal.centroidal_kernels import JOINT_RATES
from quadpips_drake.values.centroidal import STATE_SIZE
from quadpips_drake.values.legs import NUM_JOINTS


@njit(cache=True)
def swing_foot(p, v, p_ref, v_ref, normal, p_x, v_x, v_u, gain, row, by_state, by_rates, residual):
    """Writes one row of  n . (v - v_ref + gain (p - p_ref)) = 0, linearised. Returns the next free row."""
    residual[row] = 0.0
    for i in range(3):
        residual[row] += normal[i] * (v[i] - v_ref[i] + gain * (p[i] - p_ref[i]))
    x, y, z = normal[0], normal[1], normal[2]
    for j in range(STATE_SIZE):
        velocity = x * v_x[0, j] + y * v_x[1, j] + z * v_x[2, j]
        by_state[row, j] = velocity + gain * (x * p_x[0, j] + y * p_x[1, j] + z * p_x[2, j])
    for j in range(NUM_JOINTS):
        column = JOINT_RATES + j
        by_rates[row, j] = x * v_u[0, column] + y * v_u[1, column] + z * v_u[2, column]
    return row + 1
