"""The inner loops of the plane decomposition: planes through cells of one component, by RANSAC where one does not fit.

Planes are z = z0 + a (x - x0) + b (y - y0) in cells of the map: (a, b, c) with z = a i + b j + c, slopes in m per cell.
"""

import numpy as np
from numba import njit

_MAX_PLANES = 64
"""Most planes of one component."""
_REFINEMENTS = 2
"""How often a plane is fitted to the cells that it holds."""


@njit(cache=True, nogil=True)
def _next_random(state):
    """Returns the next state of a linear congruential generator; its upper 31 bits are random."""
    return state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)


@njit(cache=True, nogil=True)
def fit_plane(rows, columns, heights, chosen, count):
    """Returns (ok, a, b, c) of least squares through the cells ``chosen[:count]`` (indices)."""
    if count < 3:
        return False, 0.0, 0.0, 0.0
    mi = mj = mz = 0.0
    for k in range(count):
        i = chosen[k]
        mi, mj, mz = mi + rows[i], mj + columns[i], mz + heights[i]
    mi, mj, mz = mi / count, mj / count, mz / count
    sii = sij = sjj = siz = sjz = 0.0
    for k in range(count):
        i = chosen[k]
        di, dj, dz = rows[i] - mi, columns[i] - mj, heights[i] - mz
        sii, sij, sjj = sii + di * di, sij + di * dj, sjj + dj * dj
        siz, sjz = siz + di * dz, sjz + dj * dz
    determinant = sii * sjj - sij * sij
    if determinant <= 1e-9 * (sii + sjj) ** 2 or determinant <= 0.0:
        return False, 0.0, 0.0, 0.0
    a = (siz * sjj - sjz * sij) / determinant
    b = (sjz * sii - siz * sij) / determinant
    return True, a, b, mz - a * mi - b * mj


@njit(cache=True, nogil=True)
def _near(i, rows, columns, heights, slopes, plane, pitch, rule):
    """Whether cell ``i`` lies on the plane (a, b, c) and is turned as it is; ``rule``: max_off_plane, cos max_off_normal."""
    a, b, c = plane
    sa, sb = a / pitch, b / pitch
    scale = 1.0 / np.sqrt(1.0 + sa * sa + sb * sb)
    off = (heights[i] - a * rows[i] - b * columns[i] - c) * scale
    if abs(off) > rule[0]:
        return False
    na, nb = slopes[i, 0], slopes[i, 1]
    return (1.0 + sa * na + sb * nb) * scale >= rule[1] * np.sqrt(1.0 + na * na + nb * nb)


@njit(cache=True, nogil=True)
def _best_plane(left, size, rows, columns, heights, slopes, pitch, rule, tries, miss, state):
    """Returns ((a, b, c), state): the plane through one cell, along its slope, that holds most of ``left``."""
    best, best_plane = 0, (0.0, 0.0, 0.0)
    step = max(1, size // 400)  # cells that are tested
    tested = (size + step - 1) // step
    for attempt in range(tries):
        state = _next_random(state)
        i = left[int((state >> np.uint64(33)) % np.uint64(size))]
        a, b = slopes[i, 0] * pitch, slopes[i, 1] * pitch
        plane = (a, b, heights[i] - a * rows[i] - b * columns[i])
        count = 0
        for k in range(0, size, step):
            count += _near(left[k], rows, columns, heights, slopes, plane, pitch, rule)
        if count > best:
            best, best_plane = count, plane
        # The chance that none of the cells so far was of a plane that holds a larger share than the best one.
        if (1.0 - best / tested) ** (attempt + 1) < miss:
            break
    return best_plane, state


@njit(cache=True, nogil=True)
def split_into_planes(rows, columns, heights, slopes, pitch, rule, tries, miss, min_cells, seed):
    """Returns (plane of each cell (n,), -1 where none, planes (k, 3)) of one component.

    Least squares through all; only if a cell is off that plane or turned against it, RANSAC takes one plane after the other
    out of the component, each refined by least squares through what it holds.

    Args:
        rows, columns: of the cells in the map, (n,).
        heights: [m], (n,).
        slopes: of the map around each, dz/dx and dz/dy [1], (n, 2).
        pitch: side of a cell [m].
        rule: greatest distance from the plane [m], cosine of the greatest angle to it.
        tries, miss: of RANSAC.
        min_cells: planes with fewer are dropped.
        seed: of the generator.
    """
    n = len(rows)
    owner, planes = np.full(n, -1, np.int64), np.zeros((_MAX_PLANES, 3))
    left = np.arange(n)
    ok, a, b, c = fit_plane(rows, columns, heights, left, n)
    if not ok:
        return owner, planes[:0]
    fits = True
    for i in range(n):
        fits = fits and _near(i, rows, columns, heights, slopes, (a, b, c), pitch, rule)
    if fits:
        owner[:] = 0
        planes[0, 0], planes[0, 1], planes[0, 2] = a, b, c
        return owner, planes[:1]
    state = _next_random(np.uint64(seed) * np.uint64(2654435761) + np.uint64(40503))
    members, size, found = np.empty(n, np.int64), n, 0
    while size >= min_cells and found < _MAX_PLANES:
        plane, state = _best_plane(left, size, rows, columns, heights, slopes, pitch, rule, tries, miss, state)
        count = 0
        for refinement in range(_REFINEMENTS + 1):
            count = 0
            for k in range(size):
                if _near(left[k], rows, columns, heights, slopes, plane, pitch, rule):
                    members[count] = left[k]
                    count += 1
            ok, a, b, c = fit_plane(rows, columns, heights, members, count)
            if not ok or refinement == _REFINEMENTS:
                break
            plane = (a, b, c)
        if count < min_cells or not ok:
            break
        for k in range(count):
            owner[members[k]] = found
        planes[found, 0], planes[found, 1], planes[found, 2] = plane
        found += 1
        kept = 0
        for k in range(size):
            if owner[left[k]] < 0:
                left[kept] = left[k]
                kept += 1
        size = kept
    return owner, planes[:found]
