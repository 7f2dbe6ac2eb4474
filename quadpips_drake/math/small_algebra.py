"""Three-dimensional algebra for numba kernels: tuples instead of small arrays, so that nothing is allocated."""

import numpy as np
from numba import njit


@njit(cache=True, inline="always")
def vector(a):
    """The first three entries of an array as a tuple."""
    return (a[0], a[1], a[2])


@njit(cache=True, inline="always")
def cross(a, b):
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True, inline="always")
def add(a, b):
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@njit(cache=True, inline="always")
def subtract(a, b):
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@njit(cache=True, inline="always")
def scale(s, a):
    """s a for a number s."""
    return (s * a[0], s * a[1], s * a[2])


@njit(cache=True, inline="always")
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, inline="always")
def times(matrix, a):
    """matrix a, for a (3, 3) matrix."""
    return (dot(matrix[0], a), dot(matrix[1], a), dot(matrix[2], a))


@njit(cache=True, inline="always")
def transpose_times(matrix, a):
    """matrix^T a, for a (3, 3) matrix."""
    return (
        matrix[0, 0] * a[0] + matrix[1, 0] * a[1] + matrix[2, 0] * a[2],
        matrix[0, 1] * a[0] + matrix[1, 1] * a[1] + matrix[2, 1] * a[2],
        matrix[0, 2] * a[0] + matrix[1, 2] * a[1] + matrix[2, 2] * a[2],
    )


@njit(cache=True)
def store(out, a):
    """out[:3] = a."""
    out[0] = a[0]
    out[1] = a[1]
    out[2] = a[2]


@njit(cache=True)
def store_matrix(out, a):
    """out[:, :] = a, as a loop: to compile numba's own assignment takes a second, for the message when shapes differ."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[i, j] = a[i, j]


@njit(cache=True)
def accumulate(out, a):
    """out[:3] += a."""
    out[0] += a[0]
    out[1] += a[1]
    out[2] += a[2]


@njit(cache=True)
def inverse_3x3(m):
    """The inverse of a (3, 3) matrix by cofactors."""
    out = np.empty((3, 3))
    r0 = cross(m[1], m[2])
    r1 = cross(m[2], m[0])
    r2 = cross(m[0], m[1])
    d = 1.0 / dot(m[0], r0)
    for i in range(3):
        out[i, 0], out[i, 1], out[i, 2] = r0[i] * d, r1[i] * d, r2[i] * d
    return out
