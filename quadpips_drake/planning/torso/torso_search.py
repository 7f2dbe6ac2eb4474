"""Torso search: A* over poses above the regions (QuadPiPS section VI-B)."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.planning.region_table import in_convex_polygon, may_carry_a_foot
from quadpips_drake.planning.torso.support_map import SupportMap, ground_penalty, make_support_map
from quadpips_drake.planning.torso.torso_astar import search_lattice
from quadpips_drake.planning.torso.torso_path import join_path
from quadpips_drake.values.plans import TorsoPath
from quadpips_drake.values.regions import RegionSet


@configuration
class TorsoConfig(StageConfig):
    """Settings of the torso search (QuadPiPS section VI-B); the defaults suit ANYmal C."""

    rate: float = stage_rate(30.0)
    """How often it looks for a new request [Hz] (QuadPiPS: 30)."""

    planning_radius: float = ranged(6.0, 0.1, 50.0)
    """Regions further away than this from the robot are left out [m]."""
    node_spacing: float = ranged(0.20, 0.05, 10.0)
    """A region larger than this carries several nodes, in a grid of this spacing [m]."""
    yaw_count: int = ranged(16, 4, 72)
    """Number of yaws on the full circle; one of them points at the goal."""
    max_edge_length: float = ranged(0.36, 0.01, 2.0)
    """Longest edge of the graph [m]."""
    max_bridge_length: float = ranged(0.70, 0.0, 2.0)
    """Two points of the ground at most this far apart, with none in the middle, give a node above the gap [m]."""
    max_edge_yaw: float = ranged(0.80, 0.01, 6.3)
    """Largest change of yaw along an edge [rad] (pi / 4 in the release)."""
    start_radius: float = ranged(1.0, 0.0, 10.0)
    """The robot's pose is joined to the nodes within this distance [m]; a camera in front does not see what it stands on."""
    yaw_weight: float = ranged(0.4, 0.0, 1000.0)
    """Cost of turning [m/rad] (1 in the paper)."""
    heading_weight: float = ranged(2.0, 0.0, 1000.0)
    """Extra cost of moving sideways or backward, per metre: up to this much."""
    leg_radius: float = ranged(0.22, 0.001, 5.0)
    """A pose is left out unless each leg has steppable ground within this distance of its nominal foothold [m]."""
    free_miss: float = ranged(0.04, 0.0, 5.0)
    """A foothold that far from steppable ground costs nothing [m]: the seams between the insets of neighbouring regions."""
    max_height_difference: float = ranged(0.30, 0.0, 10.0)
    """... at a height that differs by no more than this from the ground under the base [m]."""
    support_weight: float = ranged(3.0, 0.0, 1000.0)
    """Extra cost of poses whose nominal footholds miss the ground, per metre, when the mean miss is ``leg_radius``."""
    max_slope: float = ranged(0.60, 0.0, 1.5)
    """Steepest region that counts as ground [rad]."""
    min_progress: float = ranged(0.10, 0.0, 10.0)
    """A path must end at least this much nearer to the goal than it starts [m]."""
    goal_snap: float = ranged(0.15, 0.0, 10.0)
    """A goal within this distance of steppable ground is a node of its own [m]."""
    max_yaw_rate: float = ranged(1.2, 0.01, 1000.0)
    """Fastest turning of the path while it moves [rad/m]; sharper turns are made in place."""
    pose_spacing: float = ranged(0.10, 0.01, 10.0)
    """Distance between the poses of the path [m]."""
    max_expansions: int = ranged(20000, 1, 10_000_000)
    """Most expanded nodes."""
    assume_start_ground: bool = True
    """Whether the ground between the feet is taken for granted at the first request if no foot has a region under it."""
    start_ground_margin: float = ranged(0.10, 0.0, 10.0)
    """How far that ground reaches beyond the feet [m]."""

    def __post_init__(self):
        super().__post_init__()
        if 2.0 * np.pi / self.yaw_count > self.max_edge_yaw:
            raise UserInputError("max_edge_yaw must be at least one yaw step, 2 pi / yaw_count")


@dataclass(frozen=True)
class _Lattice:
    """Positions x yaws; position 0 is the robot's own."""

    positions: np.ndarray
    """Base positions [m], (n, 3)."""
    ground: np.ndarray
    """Height of the ground under each [m], (n,)."""
    yaws: np.ndarray
    """[rad], (m,)."""
    penalty: np.ndarray
    """Extra cost per metre of each pose, inf where a leg has no ground, (n, m)."""


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


def _points_between(points: np.ndarray, support: SupportMap, config: TorsoConfig) -> np.ndarray:
    """Returns the middles of neighbouring ``points`` (n, 3) that have no ground themselves, (k, 3).

    Over stepping stones the feet often find better ground with the base above a gap than above a stone.
    """
    pairs = cKDTree(points).query_pairs(config.max_bridge_length, output_type="ndarray")
    middles = 0.5 * (points[pairs[:, 0]] + points[pairs[:, 1]])
    middles = middles[support.look_up(middles[:, :2])[0] > 1.5 * support.resolution]
    _, first = np.unique(np.round(middles / 0.1).astype(np.int64), axis=0, return_index=True)
    return middles[np.sort(first)]


def _make_lattice(p_WB, yaw_to_goal, regions, goal_xy, support, robot, config: TorsoConfig) -> tuple[_Lattice, bool]:
    """Returns the lattice and whether its last position is the goal itself."""
    height = robot.nominal_base_height
    points, normals = [], []
    for region in regions:
        on_region = _region_points(region, config.node_spacing)
        points.append(on_region)
        normals.append(np.tile(region.normal, (len(on_region), 1)))
    ground_points, normals = np.concatenate(points), np.concatenate(normals)
    between = _points_between(ground_points, support, config)
    ground_points, normals = (
        np.vstack([ground_points, between]),
        np.vstack([normals, np.tile([0.0, 0.0, 1.0], (len(between), 1))]),
    )
    positions = ground_points + height * normals
    ground = positions[:, 2] - height
    goal_distance, goal_height = support.look_up(np.asarray(goal_xy, dtype=float))
    has_goal = bool(goal_distance <= config.goal_snap)
    positions, ground = np.vstack([p_WB, positions]), np.append(p_WB[2] - height, ground)
    if has_goal:
        positions = np.vstack([positions, [*goal_xy, goal_height + height]])
        ground = np.append(ground, goal_height)

    yaws = wrap_angle(yaw_to_goal + 2.0 * np.pi * np.arange(config.yaw_count) / config.yaw_count)
    poses = np.empty((len(positions), len(yaws), 3))
    poses[..., :2], poses[..., 2] = positions[:, None, :2], yaws
    penalty = ground_penalty(support, poses, np.repeat(ground[:, None], len(yaws), axis=1), robot, config)
    penalty[0] = 0.0  # the robot stands there, whatever it has seen of the ground
    return _Lattice(positions, ground, yaws, penalty), has_goal


def _neighbours(positions: np.ndarray, config: TorsoConfig) -> tuple[np.ndarray, np.ndarray]:
    """Returns the graph over the positions in compressed rows: offsets (n + 1,) and neighbours."""
    tree = cKDTree(positions)
    rows = tree.query_ball_point(positions, config.max_edge_length, return_sorted=True)
    rows[0] = tree.query_ball_point(positions[0], config.start_radius, return_sorted=True)
    offsets = np.append(0, np.cumsum([len(row) for row in rows]))
    return offsets.astype(np.int64), np.concatenate([np.asarray(row, dtype=np.int64) for row in rows])


def _failure(stamp, request_id, regions, reason: str, **nodes) -> TorsoPath:
    return TorsoPath(stamp, request_id, np.zeros((0, 4)), regions, reason, **nodes)


def search_torso_path(
    p_WB, yaw: float, regions: RegionSet, goal_xy, robot, config: TorsoConfig, *, request_id: int = 0
) -> TorsoPath:
    """Finds a path of the torso over the regions towards the goal (QuadPiPS section VI-B).

    Nodes are the regions' points times yaws, raised by the nominal height of the base along the region's normal; edges join
    nodes that are near in position and yaw. A* minimises distance plus weighted change of yaw, plus what it costs to
    move other than forward and over poor ground. The goal node is the one nearest to the goal; the goal itself if there is
    ground. If it cannot be reached, the nearest that can be reached takes its place. Unlike in the paper, a node counts
    only if every leg would find ground near its nominal foothold: the path crosses gaps that a step bridges, and no others.

    Args:
        p_WB: position of the base in W [m], (3,).
        yaw: its yaw [rad].
        goal_xy: goal of the torso in W [m], (2,).

    Returns:
        The path, its first pose the robot's own; without poses and with a reason when there is none.
    """
    p_WB, goal_xy = np.asarray(p_WB, dtype=float), np.asarray(goal_xy, dtype=float)
    fail = lambda reason, **nodes: _failure(regions.stamp, request_id, regions, reason, **nodes)  # noqa: E731
    usable = [r for r in regions.regions if may_carry_a_foot(r, config.max_slope)]
    if not usable:
        return fail("there are no steppable regions")
    near = [r for r in usable if np.hypot(*(r.center[:2] - p_WB[:2])) <= config.planning_radius]
    if not near:
        return fail(f"no steppable region lies within {config.planning_radius:g} m of the robot")

    support = make_support_map(near)
    to_goal = goal_xy - p_WB[:2]
    yaw_to_goal = float(np.arctan2(to_goal[1], to_goal[0])) if np.hypot(*to_goal) > 0.3 else float(yaw)
    lattice, has_goal = _make_lattice(p_WB, yaw_to_goal, near, goal_xy, support, robot, config)
    offsets, neighbours = _neighbours(lattice.positions, config)
    if len(neighbours[offsets[0] : offsets[1]]) < 2:
        nearest = np.linalg.norm(lattice.positions[1:] - p_WB, axis=1).min()
        return fail(f"the robot is not connected to any region: the nearest pose above one is {nearest:.2f} m away")

    goal_distance = np.hypot(*(lattice.positions[:, :2] - goal_xy).T)
    possible = np.isfinite(lattice.penalty).any(axis=1)
    possible[0] = False
    if not possible.any():
        return fail(f"nowhere do all four legs have ground within {config.leg_radius:g} m of their nominal footholds")
    goal_node = int(np.argmin(np.where(possible, goal_distance, np.inf)))
    chain, reached, closed = _search(lattice, offsets, neighbours, yaw, goal_node, yaw_to_goal, goal_distance, config)
    nodes = {"nodes": lattice.positions[possible], "reached": closed.reshape(len(possible), -1).any(axis=1)[possible]}
    if not chain or (
        goal_distance[reached] > goal_distance[0] - config.min_progress and goal_distance[0] > config.goal_snap
    ):
        return fail(_blocked(lattice, goal_node, goal_distance), **nodes)
    end = goal_xy if has_goal and reached == len(lattice.positions) - 1 else None
    poses = join_path(p_WB, float(yaw), lattice.positions, lattice.yaws, chain, end, support, robot, config)
    return TorsoPath(regions.stamp, request_id, poses, regions, **nodes)


def _search(lattice, offsets, neighbours, yaw, goal_node, yaw_to_goal, goal_distance, config):
    """Returns the chain of (position, yaw index) from the start, the position that it ends at, and which poses were visited.

    If the goal node is out of reach the search has visited everything in reach; the visited position nearest to the goal is
    then the end.
    """
    start_yaw = int(np.argmin(np.abs(wrap_angle(lattice.yaws - yaw))))
    goal_yaw_weight = config.yaw_weight if goal_distance[goal_node] > 0.3 else 0.0
    parent, closed, found = search_lattice(
        lattice.positions, lattice.yaws, lattice.penalty, offsets, neighbours, start_yaw, goal_node, yaw_to_goal,
        goal_yaw_weight, config.yaw_weight, config.max_edge_yaw, config.heading_weight, config.max_expansions,
    )  # fmt: skip
    if found < 0:
        yaw_errors = np.abs(wrap_angle(lattice.yaws - yaw_to_goal))
        lacking = goal_distance[:, None] + config.yaw_weight * yaw_errors
        found = int(np.argmin(np.where(closed, lacking.ravel(), np.inf)))
    chain = []
    while found >= 0:
        chain.append(divmod(int(found), len(lattice.yaws)))
        found = parent[found]
    return chain[::-1], chain[0][0], closed


def _blocked(lattice: _Lattice, goal_node: int, goal_distance: np.ndarray) -> str:
    if goal_distance[goal_node] < goal_distance[0]:
        return (
            f"the way is blocked: there is ground {goal_distance[goal_node]:.2f} m from the goal, "
            f"but no torso path leads from the robot, {goal_distance[0]:.2f} m away, any nearer to the goal"
        )
    return f"no visible ground is nearer to the goal than the robot, {goal_distance[0]:.2f} m away"
