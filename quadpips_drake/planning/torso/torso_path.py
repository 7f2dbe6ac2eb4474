"""From a chain of lattice nodes to a path: straight where the ground allows, facing along it."""

import numpy as np

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.planning.torso.support_map import ground_penalty

_FACING = np.pi / 4
"""A pose faces along the path unless the search chose a yaw further off than this [rad]."""


_TURN_STEP = 0.2
"""Turning in place goes from pose to pose by so much [rad]."""


def join_path(p_WB, yaw, positions, yaws, chain, end, support, robot, config) -> np.ndarray:
    """Returns x, y, z, yaw along the path, (n, 4), the first one the robot's own.

    Args:
        p_WB, yaw: the robot's pose.
        positions, yaws: the lattice, (n, 3) and (m,).
        chain: pairs of indices (position, yaw) from the start to the end.
        end: xy of the goal if the chain ends there, else None.
        support: SupportMap for the shortcuts.
        config: TorsoConfig.
    """
    points = np.array([positions[i] for i, _ in chain])
    points[0] = p_WB
    chosen = np.array([yaws[k] for _, k in chain])
    chosen[0] = yaw
    kept = _shortcut(points, chosen, support, robot, config)
    points, chosen = _resample(points[kept], chosen[kept], config.pose_spacing)
    if end is not None:
        points[-1, :2] = end
    return _turn(points, _face_along(points, chosen), yaw, config, end is None)


def _walk_cost(start, end, yaw, support, robot, config) -> float:
    """Returns length plus penalty for poor ground of walking straight from ``start`` to ``end``, (3,) each, facing ``yaw``;
    inf where a leg has none."""
    length = float(np.linalg.norm(end - start))
    samples = start + np.linspace(0.0, 1.0, max(int(length / 0.08), 1) + 1)[1:, None] * (end - start)
    poses = np.column_stack([samples[:, :2], np.full(len(samples), yaw)])
    penalty = ground_penalty(support, poses, samples[:, 2] - robot.nominal_base_height, robot, config)
    return length * (1.0 + float(penalty.mean()))


def _shortcut(points, chosen, support, robot, config) -> list[int]:
    """Returns the indices of the nodes to keep: from each the furthest one to which the straight way is no worse."""
    ground = support, robot, config
    steps = [_walk_cost(points[k], points[k + 1], chosen[k + 1], *ground) for k in range(len(points) - 1)]
    kept = [0]
    while kept[-1] < len(points) - 1:
        i = kept[-1]
        target = i + 1
        for j in range(len(points) - 1, i + 1, -1):
            way = points[j] - points[i]
            direction = np.arctan2(way[1], way[0])
            if np.abs(wrap_angle(chosen[i + 1 : j + 1] - direction)).max() > _FACING:
                continue  # the search wanted to walk sideways or to turn: leave that part as it is
            straight = _walk_cost(points[i], points[j], direction, *ground)
            if np.isfinite(straight) and straight <= sum(steps[i:j]) + 1e-6:
                target = j
                break
        kept.append(target)
    return kept


def _resample(points, chosen, spacing):
    """Returns points and yaws at most ``spacing`` [m] apart along the polygon."""
    out_points, out_yaws = [points[0]], [chosen[0]]
    for i in range(len(points) - 1):
        length = np.linalg.norm(points[i + 1] - points[i])
        count = max(int(np.ceil(length / spacing)), 1)
        for k in range(1, count + 1):
            out_points.append(points[i] + k / count * (points[i + 1] - points[i]))
            out_yaws.append(chosen[i + 1])
    return np.array(out_points), np.array(out_yaws)


def _face_along(points, chosen) -> np.ndarray:
    """Returns the yaws, replaced by the path's direction where that is near to what the search chose."""
    yaws = chosen.copy()
    for k in range(1, len(points)):
        step = points[k] - points[k - 1]
        if np.hypot(step[0], step[1]) > 1e-6:
            direction = np.arctan2(step[1], step[0])
            if abs(wrap_angle(direction - chosen[k])) <= _FACING:
                yaws[k] = direction
    return yaws


def _turn(points, yaws, yaw, config, facing) -> np.ndarray:
    """Returns the poses with a bounded rate of turning: what a metre of path does not allow is turned in place.

    ``facing``: whether the path must end with the last yaw.
    """
    poses = [[*points[0], yaw]]
    for k in range(1, len(points)):
        length = np.linalg.norm(points[k] - points[k - 1])
        lacking = float(wrap_angle(yaws[k] - yaw))
        allowed = config.max_yaw_rate * length
        most = np.pi / 4 + allowed if length > 1e-6 else 1e-6
        while abs(lacking) > most:  # too much for walking on: turn before leaving this point
            yaw = float(wrap_angle(yaw + np.clip(lacking, -_TURN_STEP, _TURN_STEP)))
            poses.append([*points[k - 1], yaw])
            lacking = float(wrap_angle(yaws[k] - yaw))
        if length <= 1e-6:
            continue
        yaw = float(wrap_angle(yaw + np.clip(lacking, -allowed, allowed)))
        poses.append([*points[k], yaw])
    while facing and abs(wrap_angle(yaws[-1] - yaw)) > 1e-6:
        yaw = float(wrap_angle(yaw + np.clip(wrap_angle(yaws[-1] - yaw), -_TURN_STEP, _TURN_STEP)))
        poses.append([*points[-1], yaw])
    return np.array(poses)
