"""The lattice of torso poses: positions where a stance exists, times yaws."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.planning.region_table import in_convex_polygon
from quadpips_drake.planning.torso.support_map import SupportMap, ground_penalty
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_room import torso_of
from quadpips_drake.robots.stance_limits import stance_limits

_AVOIDED = 0.20
"""So near to a path that failed it is better to walk elsewhere [m] ..."""
_AVOIDANCE = 3.0
"""... and this much a metre there costs more [-]."""


@dataclass(frozen=True)
class Lattice:
    """Positions x yaws; position 0 is the robot's own."""

    positions: np.ndarray
    """Base positions [m], (n, 3)."""
    ground: np.ndarray
    """Height of the ground under each [m], (n,)."""
    yaws: np.ndarray
    """[rad], (m,)."""
    penalty: np.ndarray
    """Extra cost per metre of each pose, inf where a leg has no ground, (n, m)."""
    goal: int
    """The position that is the goal itself, -1 if there is no ground for it."""
    start_is_known: bool
    """Whether there is ground for all legs under the robot's own pose."""


def _region_points(region, spacing: float) -> np.ndarray:
    """Returns the region's origin, or a grid of points over its inset if it is larger than ``spacing``, in W, (k, 3)."""
    low, high = region.inset.min(axis=0), region.inset.max(axis=0)
    counts = np.maximum(np.round((high - low) / spacing).astype(int), 1)
    if counts.max() == 1:
        return region.center[None]
    axes = [low[i] + (np.arange(counts[i]) + 0.5) * (high[i] - low[i]) / counts[i] for i in range(2)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[in_convex_polygon(grid, region.inset)]
    return np.vstack([region.center, region.center + grid @ region.X_WR[:3, :2].T])


def _points_over_gaps(support: SupportMap, config: TorsoConfig, widest: float) -> np.ndarray:
    """Returns points without ground below them that may have some at their sides, (k, 3).

    A grid over the raster; where there is ground opposite to the nearest, at most ``widest`` [m] from it, the point moves to
    the middle between both: over a trench or between two beams the base hangs exactly there.
    """
    rows, columns = support.distance.shape
    low, high = support.origin, support.origin + support.resolution * (np.array([columns, rows]) - 1)
    axes = [
        config.node_spacing * np.arange(np.ceil(low[i] / config.node_spacing), high[i] / config.node_spacing) for i in (0, 1)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    distance, _ = support.look_up(points)
    points = points[(distance > 1.5 * support.resolution) & (distance <= 0.5 * widest)]
    if not len(points):
        return np.zeros((0, 3))
    ix, iy, _ = support.cells(points)
    near = support.origin + support.resolution * support.nearest[::-1, iy, ix].T
    across = points - near
    length = np.linalg.norm(across, axis=1)
    across /= np.maximum(length, 1e-9)[:, None]
    opposite = np.full(len(points), np.inf)
    for ahead in np.arange(support.resolution, widest, support.resolution):
        there, _ = support.look_up(points + ahead * across)
        opposite = np.where(np.isinf(opposite) & (there < support.resolution), ahead, opposite)
    between = length + opposite <= widest
    points[between] = near[between] + 0.5 * (length + opposite)[between, None] * across[between]
    _, first = np.unique(np.round(points / 0.1).astype(np.int64), axis=0, return_index=True)
    points = points[np.sort(first)]
    return np.column_stack([points, support.look_up(points)[1]])


def make_lattice(p_WB, yaw, yaw_to_goal, regions, goal_xy, avoided, support, robot, config: TorsoConfig) -> Lattice:
    """Returns the poses for which a stance exists.

    Args:
        p_WB, yaw: the robot's pose.
        yaw_to_goal: the first yaw [rad].
        regions: PlanarRegions to stand on.
        avoided: points of paths that failed, (n, 2).
        support: their SupportMap.
    """
    height = robot.nominal_base_height
    above = np.array([0.0, 0.0, height])  # straight up, as above a stance: along the normal it would hang downhill
    points = [np.asarray(p_WB, dtype=float)[None]]
    for region in regions:
        points.append(_region_points(region, config.node_spacing) + above)
    points.append(_points_over_gaps(support, config, stance_limits(robot).max_width) + above)
    goal_distance, goal_height = support.look_up(np.asarray(goal_xy, dtype=float))
    has_goal = bool(goal_distance <= config.goal_snap)
    if has_goal:
        points.append(np.array([[*goal_xy, goal_height + height]]))
    positions = np.vstack(points)
    ground = positions[:, 2] - height

    yaws = wrap_angle(yaw_to_goal + 2.0 * np.pi * np.arange(config.yaw_count) / config.yaw_count)
    poses = np.empty((len(positions), len(yaws), 3))
    poses[..., :2], poses[..., 2] = positions[:, None, :2], yaws
    penalty = ground_penalty(support, poses, np.repeat(ground[:, None], len(yaws), axis=1), robot, config)
    own = int(np.argmin(np.abs(wrap_angle(yaws - yaw))))
    known = bool(np.isfinite(ground_penalty(replace(support, high=None), poses[0, own], ground[0], robot, config)))
    if not known:
        penalty[0] = 0.0  # the robot stands there, whatever it has seen of the ground
    penalty[0, own] = 0.0
    if len(avoided):
        near = cKDTree(avoided).query(positions[:, :2])[0] < _AVOIDED
        near[0] = False
        penalty[near] += _AVOIDANCE
    kept = np.isfinite(penalty).any(axis=1)
    goal = int(kept.sum()) - 1 if has_goal and kept[-1] else -1
    return Lattice(positions[kept], ground[kept], yaws, penalty[kept], goal, known)


def neighbours_of(lattice: Lattice, support: SupportMap, robot, config: TorsoConfig) -> tuple[np.ndarray, np.ndarray]:
    """Returns the graph over the positions in compressed rows: offsets (n + 1,) and neighbours.

    The robot's own position is joined to those within ``start_radius`` if it does not know what it stands on, or if none is
    nearer; not if something too high for its torso stands between.
    """
    tree = cKDTree(lattice.positions)
    rows = tree.query_ball_point(lattice.positions, config.max_edge_length, return_sorted=True)
    if len(rows[0]) < 2 or not lattice.start_is_known:
        belly, own = torso_of(robot).belly, lattice.positions[0, :2]
        near = tree.query_ball_point(lattice.positions[0], config.start_radius, return_sorted=True)
        rows[0] = [k for k in near if support.highest_between(own, lattice.positions[k, :2]) < belly]
    offsets = np.append(0, np.cumsum([len(row) for row in rows]))
    return offsets.astype(np.int64), np.concatenate([np.asarray(row, dtype=np.int64) for row in rows])
