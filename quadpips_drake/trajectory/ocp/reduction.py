"""The quadratic model of a knot in z = [dx; w] instead of [dx; du]: what is left when the state-input equalities are gone.

With du_F = c_F + s w, where s is zero but for stance legs, and du_v = c_v + R z (see ``projection``), products with the
many zeros of du / dz are left out: a tenth of the arithmetic. No term of the cost couples forces and joint velocities.
"""

import numpy as np
from numba import njit

from quadpips_drake.trajectory.ocp.projection import NUM_FREE
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE, CentroidalInput

STAGE = STATE_SIZE + NUM_FREE
PACKED = STAGE * (STAGE + 1) // 2
"""Entries of a symmetric matrix (36, 36): its lower triangle row by row."""
_RATES = STATE_SIZE + CentroidalInput.JOINT_VELOCITIES.start


def unpacked(packed: np.ndarray) -> np.ndarray:
    """Returns the symmetric matrices (..., m, m) of their lower triangles row by row, (..., m (m + 1) / 2)."""
    size = int(np.sqrt(2 * packed.shape[-1]))
    rows, columns = np.tril_indices(size)
    full = np.empty((*packed.shape[:-1], size, size))
    full[..., rows, columns] = packed
    full[..., columns, rows] = packed
    return full


@njit(cache=True)
def reduce_cost(force_scale, change, rate_map, free, hessian, linear, packed, gradient):
    """Fills ``packed`` (666,) and ``gradient`` (36,) from the model ``hessian`` (48, 48), ``linear`` (48,) in [dx; du].

    ``linear`` is overwritten. An entry of w without effect gets a curvature of 1.
    """
    rates, stage = rate_map.shape
    for k in range(INPUT_SIZE):
        if change[k] != 0.0:
            for j in range(len(linear)):
                linear[j] += change[k] * hessian[STATE_SIZE + k, j]
    # R' (H_vx dx) + its transpose + R' H_vv R = R' half + half' R.
    half = np.zeros((rates, stage))
    for i in range(rates):
        for j in range(STATE_SIZE):
            half[i, j] = hessian[_RATES + i, j]
        for k in range(rates):
            part = 0.5 * hessian[_RATES + i, _RATES + k]
            if part != 0.0:
                for j in range(stage):
                    half[i, j] += part * rate_map[k, j]
    for j in range(stage):
        gradient[j] = linear[j] if j < STATE_SIZE else force_scale[j - STATE_SIZE] * linear[j]
    for k in range(rates):
        part = linear[_RATES + k]
        for j in range(stage):
            gradient[j] += part * rate_map[k, j]
    start = 0
    for i in range(stage):
        row = packed[start : start + i + 1]
        start += i + 1
        if i < STATE_SIZE:
            for j in range(i + 1):
                row[j] = hessian[i, j]
        else:
            scale = force_scale[i - STATE_SIZE]
            for j in range(i + 1):
                row[j] = scale * hessian[i, j]
                if j >= STATE_SIZE:
                    row[j] *= force_scale[j - STATE_SIZE]
            if not free[i - STATE_SIZE]:
                row[i] = 1.0
            if scale != 0.0:
                continue
        for k in range(rates):
            left, right = rate_map[k, i], half[k, i]
            for j in range(i + 1):
                row[j] += left * half[k, j] + right * rate_map[k, j]


@njit(cache=True)
def reduce_dynamics(force_scale, change, rate_map, full, dynamics, defect):
    """Fills ``dynamics`` (24, 36) in z from ``full`` (24, 48) in [dx; du]; adds what ``change`` does to ``defect``."""
    rates, stage = rate_map.shape
    for i in range(len(full)):
        for j in range(stage):
            dynamics[i, j] = full[i, j] if j < STATE_SIZE else force_scale[j - STATE_SIZE] * full[i, j]
        for k in range(INPUT_SIZE):
            defect[i] += full[i, STATE_SIZE + k] * change[k]
        for k in range(rates):
            part = full[i, _RATES + k]
            if part != 0.0:
                for j in range(stage):
                    dynamics[i, j] += part * rate_map[k, j]
