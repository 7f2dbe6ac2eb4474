"""The part of the torso path that the foothold search follows, and its waypoint."""

import numpy as np

from quadpips_drake.values.plans import TorsoPath
from quadpips_drake.values.robot_state import RobotState


def local_path(state: RobotState, torso_path: TorsoPath, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns x, y, yaw of the leading poses of the torso path within ``radius`` [m], (n, 3), and the waypoint, (4,).

    The path starts at the base's present pose; the waypoint, x, y, z, yaw, is the last of these poses.
    """
    poses = torso_path.poses
    far = np.flatnonzero(np.hypot(*(poses[:, :2] - state.p_WB[:2]).T) > radius)
    count = max(int(far[0]) if len(far) else len(poses), min(2, len(poses)))
    path = poses[:count][:, [0, 1, 3]]
    if np.hypot(*(path[0, :2] - state.p_WB[:2])) > 1e-3:
        path = np.vstack([[*state.p_WB[:2], state.rpy_WB[2]], path])
    return np.ascontiguousarray(path, dtype=float), poses[count - 1]


def prefix_lengths(count: int, retries: int) -> list[int]:
    """Returns how many poses of the path to follow, in the order of the attempts: all, then fewer, down to a quarter."""
    fewest = min(count, max(2, count // 4))
    return sorted({int(k) for k in np.linspace(count, fewest, retries + 1)}, reverse=True)
