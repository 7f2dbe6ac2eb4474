"""Elimination of state-input equalities: the inputs that remain free, of which there are at most twelve per knot.

Swing feet carry no force and stance feet do not move, so of the 24 inputs no more than 12 are free: forces of stance feet
and, from the null space of the velocity rows, joint velocities of swinging legs. Solving in these w instead of u makes the
quadratic program a quarter smaller and rids it of its equalities but the dynamics.

    d(forces) = change + force_scale w,      d(joint velocities) = change + rate_map [dx; w]

Loops here run along rows of arrays, so that the compiler does several entries at once.
"""

import numpy as np
from numba import njit

from quadpips_drake.values.centroidal import CentroidalInput
from quadpips_drake.values.legs import NUM_JOINTS

NUM_FREE = NUM_JOINTS
"""Entries of w: three for each leg."""
_JOINT_RATES = CentroidalInput.JOINT_VELOCITIES.start
_SMALLEST_PIVOT = 1e-6


@njit(cache=True)
def orthogonal_basis(rows, count):
    """Householder QR of the transpose of the first ``count`` = m of the ``rows`` (., n), m <= n: rows^T = Q[:, :m] R.

    Returns R (m, m) and Q^T (n, n) beside each other, (n, m + n); what lies below the diagonal of R is rounding.
    """
    n = rows.shape[1]
    work = np.zeros((n, count + n))
    reflector, projection = np.empty(n), np.empty(count + n)
    for i in range(n):
        for j in range(count):
            work[i, j] = rows[j, i]
        work[i, count + i] = 1.0
    for j in range(count):
        squared = 0.0
        for i in range(j, n):
            reflector[i] = work[i, j]
            squared += reflector[i] * reflector[i]
        norm = np.sqrt(squared)
        if norm < 1e-14:
            continue
        alpha = -norm if reflector[j] > 0.0 else norm
        squared -= reflector[j] * reflector[j]
        reflector[j] -= alpha
        factor = 2.0 / (squared + reflector[j] * reflector[j])
        projection[j:] = 0.0
        for i in range(j, n):
            part = factor * reflector[i]
            for k in range(j, count + n):
                projection[k] += part * work[i, k]
        for i in range(j, n):
            part = reflector[i]
            for k in range(j, count + n):
                work[i, k] -= part * projection[k]
    return work


@njit(cache=True)
def project_inputs(stance, num_rows, by_state, by_rates, residual, force_unit, change, force_scale, rate_map, free):
    """Fills d(joint velocities) = change[12:] + rate_map [dx; w] so that by_state dx + by_rates d(joint velocities) +
    residual = 0 in the first num_rows rows, which are overwritten; force_scale (12,); free (12,) bool: which w act.

    stance (4,) bool; change (24,), whose force part is already written; rate_map (12, 36). Three entries of w belong to each
    leg: a stance leg's are its force in units of ``force_unit`` [N].
    """
    rates, states = len(rate_map), by_state.shape[1]
    factors = orthogonal_basis(by_rates, num_rows)
    change[_JOINT_RATES:] = 0.0
    rate_map[:, :] = 0.0
    # Forward substitution with R^T: d(joint velocities) = -Q1 R^-T (by_state dx + residual).
    for i in range(num_rows):
        for k in range(i):
            part = factors[k, i]
            residual[i] -= part * residual[k]
            for j in range(states):
                by_state[i, j] -= part * by_state[k, j]
        pivot = factors[i, i]
        if abs(pivot) < _SMALLEST_PIVOT:  # a stretched leg: this direction cannot be held, let it be small
            pivot = _SMALLEST_PIVOT if pivot >= 0 else -_SMALLEST_PIVOT
        inverse = 1.0 / pivot
        residual[i] *= inverse
        for j in range(states):
            by_state[i, j] *= inverse
        for row in range(rates):
            part = factors[i, num_rows + row]
            change[_JOINT_RATES + row] -= part * residual[i]
            for j in range(states):
                rate_map[row, j] -= part * by_state[i, j]
    column = num_rows
    for slot in range(NUM_FREE):
        down = stance[slot // 3]
        force_scale[slot] = force_unit if down else 0.0
        free[slot] = down or column < NUM_FREE
        if not down and column < NUM_FREE:
            for row in range(rates):
                rate_map[row, states + slot] = factors[column, num_rows + row]
            column += 1
