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


@njit(cache=True)
def roll_pitch_yaw_rotation(rpy):
    """R_WB = Rz(yaw) Ry(pitch) Rx(roll), (3, 3), and its derivatives by roll, pitch, yaw, (3, 3, 3)."""
    sr, cr = np.sin(rpy[0]), np.cos(rpy[0])
    sp, cp = np.sin(rpy[1]), np.cos(rpy[1])
    sy, cy = np.sin(rpy[2]), np.cos(rpy[2])
    rotation, derivatives = np.empty((3, 3)), np.zeros((3, 3, 3))
    rotation[0, 0], rotation[0, 1], rotation[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    rotation[1, 0], rotation[1, 1], rotation[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    rotation[2, 0], rotation[2, 1], rotation[2, 2] = -sp, cp * sr, cp * cr
    for i in range(3):
        # Rolling turns the base's y axis into z and z into -y; yawing turns the world's x into y.
        derivatives[0, i, 1], derivatives[0, i, 2] = rotation[i, 2], -rotation[i, 1]
        derivatives[2, 0, i], derivatives[2, 1, i] = -rotation[1, i], rotation[0, i]
    pitch = derivatives[1]
    pitch[0, 0], pitch[0, 1], pitch[0, 2] = -cy * sp, cy * cp * sr, cy * cp * cr
    pitch[1, 0], pitch[1, 1], pitch[1, 2] = -sy * sp, sy * cp * sr, sy * cp * cr
    pitch[2, 0], pitch[2, 1], pitch[2, 2] = -cp, -sp * sr, -sp * cr
    return rotation, derivatives


@njit(cache=True)
def roll_pitch_yaw_rates(rpy):
    """T with d(rpy)/dt = T w_B (angular velocity in B), (3, 3), and its derivatives by roll and pitch, (2, 3, 3)."""
    sr, cr = np.sin(rpy[0]), np.cos(rpy[0])
    sp, cp = np.sin(rpy[1]), np.cos(rpy[1])
    tp = sp / cp
    rates, derivatives = np.zeros((3, 3)), np.zeros((2, 3, 3))
    rates[0, 0], rates[0, 1], rates[0, 2] = 1.0, sr * tp, cr * tp
    rates[1, 1], rates[1, 2] = cr, -sr
    rates[2, 1], rates[2, 2] = sr / cp, cr / cp
    derivatives[0, 0, 1], derivatives[0, 0, 2] = cr * tp, -sr * tp
    derivatives[0, 1, 1], derivatives[0, 1, 2] = -sr, -cr
    derivatives[0, 2, 1], derivatives[0, 2, 2] = cr / cp, -sr / cp
    secant2 = 1.0 / (cp * cp)
    derivatives[1, 0, 1], derivatives[1, 0, 2] = sr * secant2, cr * secant2
    derivatives[1, 2, 1], derivatives[1, 2, 2] = sr * sp * secant2, cr * sp * secant2
    return rates, derivatives
