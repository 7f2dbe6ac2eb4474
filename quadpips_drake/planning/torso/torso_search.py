"""Torso search: A* over poses above the regions (QuadPiPS section VI-B)."""

import numpy as np

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.planning.region_table import may_carry_a_foot
from quadpips_drake.planning.torso.gaps import widest_gap
from quadpips_drake.planning.torso.subgoals import Exploration, choose_subgoal
from quadpips_drake.planning.torso.support_map import make_support_map, places_of_legs
from quadpips_drake.planning.torso.torso_astar import Ground, search_lattice
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_lattice import make_lattice, neighbours_of
from quadpips_drake.planning.torso.torso_path import join_path
from quadpips_drake.planning.torso.torso_room import torso_of
from quadpips_drake.values.plans import TorsoPath
from quadpips_drake.values.regions import GroundHeights, RegionSet

_NO_POSES = np.zeros((0, 4))
_LOOK_ROUND = 4
"""From this level of escalation on a robot whose last plan failed goes where it sees more."""
_AT_GOAL = 0.3
"""A goal nearer than this [m] has no direction."""


def search_torso_path(
    p_WB,
    yaw: float,
    regions: RegionSet,
    goal_xy,
    robot,
    config: TorsoConfig,
    *,
    request_id: int = 0,
    level: int = 0,
    exploration: Exploration | None = None,
    every_label: bool = False,
    heights: GroundHeights | None = None,
) -> TorsoPath:
    """Finds a path of the torso over the regions towards the goal (QuadPiPS section VI-B).

    Nodes are poses with room for a stance: the regions' points and places over gaps, times yaws, at the nominal height of
    the base; edges join nodes that are near in position and yaw. A* minimises distance plus weighted change of yaw, plus
    what it costs to move other than forward and over poor ground. If the goal is out of reach, see ``choose_subgoal``.

    Args:
        p_WB, yaw: position of the base in W [m], (3,), and its yaw [rad].
        goal_xy: goal of the torso in W [m], (2,).
        level: of escalation.
        exploration: what was tried before; nothing by default.
        every_label: whether regions of every label are ground, not only those that are steppable or unknown.
        heights: of all surfaces, which the torso must not hit; None: unknown.

    Returns the path, its first pose the robot's own; without poses and with a reason when there is none.
    """
    p_WB, goal_xy, yaw = np.asarray(p_WB, dtype=float), np.asarray(goal_xy, dtype=float), float(yaw)
    exploration = exploration or Exploration().standing_at((*p_WB[:2], yaw), goal_xy)

    def result(poses=_NO_POSES, reason="", to_goal=False, **nodes):
        return TorsoPath(regions.stamp, request_id, poses, regions, reason, level, to_goal, exploration.viewpoints, **nodes)

    near, reason = _ground_near(regions, p_WB, config, every_label)
    if not near:
        return result(reason=reason)
    support, ahead = make_support_map(near, heights=heights), _bearing(goal_xy - p_WB[:2], yaw)
    lattice = make_lattice(p_WB, yaw, ahead, near, goal_xy, exploration.avoided, support, robot, config)
    if len(lattice.positions) < 2:
        return result(reason="nowhere near do all four legs have ground")
    graph = neighbours_of(lattice, support, robot, config)
    if graph[0][1] < 2:
        return result(reason=_not_connected(lattice))
    search = _searcher(lattice, graph, support, yaw, robot, config)
    end = None
    found, parent, closed, cost = _way_to_see_more(search, lattice, yaw, goal_xy, exploration, support, level, config)
    if found < 0:
        parent, closed, cost, found = search(lattice.goal)
        end = goal_xy if found >= 0 else None
    nodes = {"nodes": lattice.positions, "reached": closed.reshape(len(lattice.positions), -1).any(axis=1)}
    if found < 0:
        found = choose_subgoal(lattice, yaw, cost, closed, goal_xy, exploration, support, config)
    if found < 0:
        return result(reason=_blocked(lattice, closed, goal_xy, support, robot), **nodes)
    chain = _chain(parent, found, len(lattice.yaws))
    poses = join_path(p_WB, yaw, lattice.positions, lattice.yaws, chain, end, support, robot, config)
    return result(poses, to_goal=end is not None, **nodes)


def _searcher(lattice, graph, support, yaw, robot, config: TorsoConfig):
    """Returns ``search_lattice`` as a function of the position to go to, -1: to all poses in reach."""
    ground = _ground(support, robot, config)
    start_yaw = int(np.argmin(np.abs(wrap_angle(lattice.yaws - yaw))))
    return lambda goal: search_lattice(
        lattice.positions, lattice.yaws, lattice.penalty, *graph, ground, start_yaw,
        goal, config.yaw_weight, config.max_edge_yaw, config.heading_weight, config.max_expansions,
    )  # fmt: skip


def _way_to_see_more(search, lattice, yaw, goal_xy, exploration, support, level, config: TorsoConfig):
    """Returns the pose from which the robot sees more, -1 if it need not or cannot, and what ``search`` to all poses found.

    The last thing to try before there is no plan: ground that ends too near to be seen looks like a gap.
    """
    if level < _LOOK_ROUND or not len(exploration.in_vain):
        return -1, None, None, None
    parent, closed, cost, _ = search(-1)
    found = choose_subgoal(lattice, yaw, cost, closed, goal_xy, exploration, support, config, to_see=True)
    return found, parent, closed, cost


def _ground(support, robot, config: TorsoConfig) -> Ground:
    """Returns what the search on the lattice needs to know of the ground between poses."""
    return Ground(
        support.distance, support.height, support.origin, support.resolution,
        places_of_legs(robot, float(config.leg_radius)),
        float(config.max_height_difference), float(robot.nominal_base_height), float(config.bridge_cost),
    )  # fmt: skip


def _bearing(to_goal, yaw: float) -> float:
    """Returns the direction of ``to_goal`` (2,), ``yaw`` if that is short [rad]."""
    return float(np.arctan2(to_goal[1], to_goal[0])) if np.hypot(*to_goal) > _AT_GOAL else yaw


def _ground_near(regions: RegionSet, p_WB, config: TorsoConfig, every_label: bool) -> tuple[list, str]:
    """Returns the steppable regions around the robot; if there are none, why."""
    usable = [r for r in regions.regions if may_carry_a_foot(r, config.max_slope, every_label)]
    if not usable:
        return [], "there are no steppable regions"
    near = [r for r in usable if np.hypot(*(r.center[:2] - p_WB[:2])) <= config.planning_radius]
    return near, "" if near else f"no steppable region lies within {config.planning_radius:g} m of the robot"


def _chain(parent, found: int, yaw_count: int) -> list[tuple[int, int]]:
    """Returns the pairs (position, yaw index) from the start to the pose ``found``."""
    chain = []
    while found >= 0:
        chain.append(divmod(int(found), yaw_count))
        found = parent[found]
    return chain[::-1]


def _not_connected(lattice) -> str:
    nearest = np.linalg.norm(lattice.positions[1:] - lattice.positions[0], axis=1).min()
    return f"the robot is not connected to any region: the nearest pose above one is {nearest:.2f} m away"


def _blocked(lattice, closed, goal_xy, support, robot) -> str:
    """Says why there is neither a path to the goal nor a sub-goal."""
    m = len(lattice.yaws)
    reached = np.unique(np.flatnonzero(closed) // m)
    own = np.hypot(*(lattice.positions[0, :2] - goal_xy))
    gap = widest_gap(support, lattice.positions[reached], goal_xy)
    if gap is not None:
        width, (x, y) = gap
        rise = support.highest_near(np.array([x, y]), 0.5 * width)
        if rise > torso_of(robot).belly:
            what = f"what stands {rise:.2f} m high at ({x:.2f}, {y:.2f})"
            return f"the way is blocked: {what} is before the goal, {own:.2f} m away"
        return f"the way is blocked: a gap {width:.2f} m wide at ({x:.2f}, {y:.2f}) lies before the goal, {own:.2f} m away"
    nearest = np.hypot(*(lattice.positions[reached, :2] - goal_xy).T).min()
    return (
        f"the way is blocked: all that can be reached was seen and leads no nearer to the goal than {nearest:.2f} m; "
        f"the robot is {own:.2f} m away"
    )
