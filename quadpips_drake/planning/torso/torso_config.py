"""Configuration of the torso search."""

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig, stage_rate


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
    max_edge_yaw: float = ranged(0.80, 0.01, 6.3)
    """Largest change of yaw along an edge [rad] (pi / 4 in the release)."""
    start_radius: float = ranged(1.0, 0.0, 10.0)
    """The robot's pose is joined to the nodes within this distance [m]; a camera in front does not see what it stands on."""
    yaw_weight: float = ranged(0.4, 0.0, 1000.0)
    """Cost of turning [m/rad] (1 in the paper)."""
    heading_weight: float = ranged(2.0, 0.0, 1000.0)
    """Extra cost of moving sideways or backward, per metre: up to this much."""
    leg_radius: float = ranged(0.22, 0.001, 5.0)
    """A pose is left out unless each leg has steppable ground near its nominal foothold: within this distance forward or
    backward [m], and to the side as far as the robot's stance limits go."""
    free_miss: float = ranged(0.04, 0.0, 5.0)
    """A foothold that far from steppable ground costs nothing [m]: the seams between the insets of neighbouring regions."""
    max_height_difference: float = ranged(0.30, 0.0, 10.0)
    """... at a height that differs by no more than this from the ground under the base [m]."""
    belly_clearance: float = ranged(0.05, -1.0, 1.0)
    """A pose is left out where something comes nearer to the torso's belly than this [m], a stance where it comes that near
    to the belly or the sides; more than what the monitor stops for (``monitor.ground.body_clearance``)."""
    body_margin: float = ranged(0.10, 0.0, 0.3)
    """... or stands that near to the torso's sides [m]: stances follow the path only about as exactly."""
    support_weight: float = ranged(3.0, 0.0, 1000.0)
    """Extra cost of poses whose nominal footholds miss the ground, per metre, when the mean miss is ``leg_radius``."""
    bridge_cost: float = ranged(0.0, 0.0, 1000.0)
    """Extra cost of an edge between whose ends some leg finds no ground: there a longer swing is needed than ``leg_radius``
    allows for [m]. 0: only the ends count."""
    max_slope: float = ranged(0.60, 0.0, 1.5)
    """Steepest region that counts as ground [rad]."""
    min_progress: float = ranged(0.10, 0.0, 10.0)
    """A sub-goal must be at least this much nearer to the goal than the robot has ever been [m], or show something new."""
    min_novelty: float = ranged(0.5, 0.0, 1.0)
    """... so large must be the share of unseen places beside known ground in the view from it [-]."""
    max_detour: int = ranged(16, 0, 10_000)
    """After so many plans in a row that led no nearer to the goal, new views are no reason to go on."""
    novelty_weight: float = ranged(1.0, 0.0, 1000.0)
    """What a sub-goal costs more that shows nothing new [m]."""
    way_weight: float = ranged(0.3, 0.0, 10.0)
    """Cost of the way to a sub-goal, as a factor on the path's; 0: the place nearest to the goal, however far about [-]."""
    view_range: float = ranged(1.7, 0.1, 50.0)
    """How far the ground counts as seen from a place where the robot stood [m]."""
    view_near: float = ranged(0.75, 0.0, 50.0)
    """How near before the base it begins to be seen [m]; only asked for where the robot steps back to see more."""
    view_half_angle: float = ranged(0.7, 0.05, 3.2)
    """... and how far to either side of straight ahead [rad]."""
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
