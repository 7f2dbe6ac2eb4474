"""Rotations: about the vertical, by roll, pitch and yaw, from quaternions; compiled where kernels need them.

Roll, pitch, yaw (rpy) of a frame B in W mean R_WB = Rz(yaw) Ry(pitch) Rx(roll), as in Drake.
"""

import numpy as np
from numba import njit


def yaw_matrix(yaw: float) -> np.ndarray:
    """Returns Rz(yaw), (3, 3): from a frame that faces ``yaw`` [rad] to W; ``[:2, :2]`` is the same in the plane."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@njit(cache=True, inline="always")
def _sines(rpy):
    return np.sin(rpy[0]), np.cos(rpy[0]), np.sin(rpy[1]), np.cos(rpy[1]), np.sin(rpy[2]), np.cos(rpy[2])


@njit(cache=True, inline="always")
def _rotation(sines):
    sr, cr, sp, cp, sy, cy = sines
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    R[1, 0], R[1, 1], R[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    R[2, 0], R[2, 1], R[2, 2] = -sp, cp * sr, cp * cr
    return R


@njit(cache=True)
def rotation_from_rpy(rpy):
    """Returns R_WB, (3, 3), of roll, pitch, yaw [rad], an array (3,)."""
    return _rotation(_sines(rpy))


@njit(cache=True)
def rotation_derivatives(rpy):
    """Returns R_WB, (3, 3), as ``rotation_from_rpy``, and its derivatives by roll, pitch, yaw, (3, 3, 3)."""
    sines = _sines(rpy)
    rotation, derivatives = _rotation(sines), np.zeros((3, 3, 3))
    sr, cr, sp, cp, sy, cy = sines
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


@njit(cache=True)
def body_rates(rpy, rpy_rates):
    """Returns the angular velocity in B [rad/s], (3,), of a frame whose roll, pitch, yaw change at ``rpy_rates``."""
    sr, cr, sp, cp = np.sin(rpy[0]), np.cos(rpy[0]), np.sin(rpy[1]), np.cos(rpy[1])
    roll, pitch, yaw = rpy_rates[0], rpy_rates[1], rpy_rates[2]
    return np.array([roll - sp * yaw, cr * pitch + sr * cp * yaw, -sr * pitch + cr * cp * yaw])


@njit(cache=True)
def attitude_from_quaternion(quaternion):
    """Returns roll, pitch, yaw (3,) and the rotation matrix (3, 3) of a quaternion w x y z, (4,), of any length."""
    w, x, y, z = quaternion / np.sqrt((quaternion * quaternion).sum())
    rotation = np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
    roll, yaw = np.arctan2(rotation[2, 1], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[0, 0])
    # The length of the lower row's other two entries keeps precision where asin loses it.
    pitch = np.arctan2(-rotation[2, 0], np.sqrt(rotation[2, 1] ** 2 + rotation[2, 2] ** 2))
    return np.array([roll, pitch, yaw]), rotation
