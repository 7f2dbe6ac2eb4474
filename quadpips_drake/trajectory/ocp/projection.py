"""Elimination of state-input equalities: the inputs that remain free, of which there are at most twelve per knot.

Swing feet carry no force and stance feet do not move, so of the 24 inputs no more than 12 are free: forces of stance feet
and, from the null space of the velocity rows, joint velocities of swinging legs. Solving in these w instead of u makes the
quadratic program a quarter smaller and rids it of its equalities but the dynamics.

    du = change + map [dx; w]
"""

import numpy as np
from numba import njit

from quadpips_drake.values.centroidal import STATE_SIZE, CentroidalInput
from quadpips_drake.values.legs import NUM_JOINTS

NUM_FREE = NUM_JOINTS
"""Entries of w: three for each leg."""
_JOINT_RATES = CentroidalInput.JOINT_VELOCITIES.start
_SMALLEST_PIVOT = 1e-6


@njit(cache=True)
def orthogonal_basis(rows):
    """Householder QR of rows^T: rows (m, n), m <= n, gives Q (n, n) and R (m, m) with rows^T = Q[:, :m] R."""
    m, n = rows.shape
    work, basis = rows.T.copy(), np.eye(n)
    for j in range(m):
        norm = 0.0
        for i in range(j, n):
            norm += work[i, j] * work[i, j]
        norm = np.sqrt(norm)
        if norm < 1e-14:
            continue
        alpha = -norm if work[j, j] > 0 else norm
        reflector = np.zeros(n)
        reflector[j:] = work[j:, j]
        reflector[j] -= alpha
        factor = 2.0 / (reflector @ reflector)
        for k in range(j, m):
            projection = 0.0
            for i in range(j, n):
                projection += reflector[i] * work[i, k]
            for i in range(j, n):
                work[i, k] -= factor * projection * reflector[i]
        for i in range(n):
            projection = 0.0
            for k in range(j, n):
                projection += basis[i, k] * reflector[k]
            for k in range(j, n):
                basis[i, k] -= factor * projection * reflector[k]
    return basis, work[:m, :m]


@njit(cache=True)
def project_inputs(stance, num_rows, by_state, by_rates, residual, force_unit, change, input_map, free):
    """Fills du = change + input_map [dx; w] so that by_state dx + by_rates dv_j + residual = 0 in the first num_rows rows.

    stance (4,) bool; change (24,), whose force part is already written; input_map (24, 36); free (12,) bool says which
    entries of w act. Three entries of w belong to each leg: a stance leg's are its force in units of ``force_unit`` [N].
    """
    input_map[:, :] = 0.0
    free[:] = False
    basis, triangle = orthogonal_basis(by_rates[:num_rows])
    # Forward substitution with R^T: dv_j = -Q1 R^-T (by_state dx + residual).
    solved = np.empty((num_rows, STATE_SIZE + 1))
    for i in range(num_rows):
        solved[i, :STATE_SIZE] = by_state[i]
        solved[i, STATE_SIZE] = residual[i]
        for k in range(i):
            solved[i] -= triangle[k, i] * solved[k]
        pivot = triangle[i, i]
        if abs(pivot) < _SMALLEST_PIVOT:  # a stretched leg: this direction cannot be held, let it be small
            pivot = _SMALLEST_PIVOT if pivot >= 0 else -_SMALLEST_PIVOT
        solved[i] /= pivot
    particular = np.ascontiguousarray(basis[:, :num_rows]) @ solved
    input_map[_JOINT_RATES:, :STATE_SIZE] = -particular[:, :STATE_SIZE]
    change[_JOINT_RATES:] = -particular[:, STATE_SIZE]
    column = num_rows
    for leg in range(4):
        for i in range(3):
            slot = 3 * leg + i
            if stance[leg]:
                input_map[slot, STATE_SIZE + slot] = force_unit
                free[slot] = True
            elif column < NUM_FREE:
                input_map[_JOINT_RATES:, STATE_SIZE + slot] = basis[:, column]
                free[slot] = True
                column += 1
