"""The nominal pose of the base above four footholds."""

import numpy as np
from numba import njit


@njit(cache=True)
def base_pose_above(feet, height, max_tilt):
    """Returns the nominal base position (3,) and roll-pitch-yaw (3,) in W above the ground points ``feet`` (4, 3) in W.

    The base points from the middle of the hind feet to the middle of the fore feet and tilts with the least-squares plane
    through the feet, by at most ``max_tilt`` [rad] in roll and in pitch. Its origin is ``height`` [m] above the mean of the
    feet, less the depth of the lowest foot below the plane, so that no leg has to stretch further than on flat ground.
    QuadPiPS goes along the plane's normal instead of straight up; on a slope that carries the centre of mass downhill, out
    of the middle of the support (0.10 m for ANYmal on 10 degrees).
    """
    center, rpy = np.empty(3), np.empty(3)
    write_base_pose_above(feet, height, max_tilt, center, rpy)
    return center, rpy


@njit(cache=True)
def write_base_pose_above(feet, height, max_tilt, center, rpy):
    """Writes ``base_pose_above`` into ``center`` (3,) and ``rpy`` (3,), for searches, without allocating anything."""
    center[0] = center[1] = center[2] = 0.0
    for leg in range(4):
        for i in range(3):
            center[i] += 0.25 * feet[leg, i]
    xx = xy = yy = xz = yz = 0.0
    for leg in range(4):
        dx, dy, dz = feet[leg, 0] - center[0], feet[leg, 1] - center[1], feet[leg, 2] - center[2]
        xx += dx * dx
        xy += dx * dy
        yy += dy * dy
        xz += dx * dz
        yz += dy * dz
    determinant = xx * yy - xy * xy
    slope_x = slope_y = 0.0
    if determinant > 1e-9:  # else the feet are in one line and the plane is undefined: keep the base level
        slope_x = (xz * yy - yz * xy) / determinant
        slope_y = (yz * xx - xz * xy) / determinant

    lowest = 0.0
    for leg in range(4):
        dx, dy, dz = feet[leg, 0] - center[0], feet[leg, 1] - center[1], feet[leg, 2] - center[2]
        lowest = min(lowest, dz - slope_x * dx - slope_y * dy)

    forward_x = feet[0, 0] + feet[1, 0] - feet[2, 0] - feet[3, 0]
    forward_y = feet[0, 1] + feet[1, 1] - feet[2, 1] - feet[3, 1]
    yaw = np.arctan2(forward_y, forward_x)
    ahead = slope_x * np.cos(yaw) + slope_y * np.sin(yaw)
    left = -slope_x * np.sin(yaw) + slope_y * np.cos(yaw)
    roll = np.arcsin(left / np.sqrt(1.0 + ahead * ahead + left * left))
    pitch = -np.arctan(ahead)
    rpy[0], rpy[1], rpy[2] = min(max(roll, -max_tilt), max_tilt), min(max(pitch, -max_tilt), max_tilt), yaw
    center[2] += height + lowest


@njit(cache=True)
def to_frame(R, origin, x, y, z):
    """Returns the coordinates of the point (x, y, z) in the frame with axes ``R`` (3, 3) at ``origin`` (3,).

    Scalars instead of small arrays: the searches call this so often that allocating would dominate.
    """
    x, y, z = x - origin[0], y - origin[1], z - origin[2]
    return (
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
    )
