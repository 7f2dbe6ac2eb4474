"""Configuration of the foothold search."""

import math
from dataclasses import dataclass, field

from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig
from quadpips_drake.gaits.swing_gaits import swing_gait

CANDIDATES = ("nearest", "center")


@dataclass
class FootholdConfig(StageConfig):
    """Settings of the foothold search (QuadPiPS section VI-C); the defaults suit ANYmal C."""

    rate: float = 15.0
    """How often it looks for a new torso path [Hz] (QuadPiPS: 15)."""

    gait: str = "standing_trot"
    """Order of the swings: standing_trot, slow_trot or standing_walk."""
    any_first_phase: bool = True
    """Whether a plan may begin with any phase of the gait; else always with the first."""
    max_steps: int = 8
    """Most swings in a plan: 8 are four cycles of a trot, two of a walk."""
    local_radius: float = 1.25
    """Radius around the torso within which the local waypoint is taken from the torso path [m] (1.25 in the release)."""
    goal_tolerance: float = 0.12
    """A plan is complete when it ends with the base this close to the waypoint, in xy [m] (the release: 0.25)."""
    goal_yaw_tolerance: float = 0.25
    """... and its yaw this close to the waypoint's [rad]."""
    min_progress: float = 0.10
    """A plan that does not reach its waypoint counts only if it gets at least this much nearer to it [m]."""
    waypoint_retries: int = 3
    """How often to try an earlier pose of the torso path when nothing leads to the waypoint."""

    candidate: str = "nearest"
    """Foothold of a region: "nearest" point of its inset to where the foot wants to go, or its "center" as in the paper."""
    candidates_per_leg: int = 12
    """Footholds kept for each swinging leg and expansion."""
    inward_pull: float = 0.03
    """How far beyond the nearest point of the inset a foothold is moved away from the edge [m]."""
    max_slope: float = 0.60
    """Steepest region that carries a foot [rad]."""
    min_separation: float = 0.15
    """Least distance between two feet on the ground [m]: this, not the region's identity, keeps them apart."""

    reach_offset: list[float] = field(default_factory=lambda: [0.0, 0.02, 0.05])
    """Centre of the superquadric (eq. 15) from the nominal foot in B: forward, outward, up [m]."""
    reach_semi_axes: list[float] = field(default_factory=lambda: [0.42, 0.22, 0.28])
    """Semi-axes a, b, c of the superquadric [m]."""
    reach_exponents: list[float] = field(default_factory=lambda: [4.0, 4.0, 4.0])
    """Exponents d, e, f of the superquadric."""
    max_extension: float = 0.98
    """Longest leg at touch-down and lift-off, as a fraction of the straight one."""
    max_swing: float = 0.45
    """Longest way from lift-off to touch-down [m] (eq. 18)."""
    max_rise: float = 0.25
    """Largest height difference between lift-off and touch-down [m]."""
    width_tolerance: float = 0.20
    """Largest deviation of a stance's width, fore or hind, from the nominal one [m] (eq. 17)."""
    length_tolerance: float = 0.35
    """Largest deviation of a stance's length, left or right, from the nominal one [m] (eq. 17)."""
    max_support_distance: float = 0.10
    """During a swing, largest distance from the base's mean position to where the feet on the ground support it [m]."""
    max_tilt: float = 0.35
    """Largest roll and pitch of the nominal base [rad]."""
    max_yaw_step: float = 0.20
    """Largest change of yaw that one swing aims for [rad]."""

    preferred_swing: float = 0.30
    """Length of a swing that costs least per distance travelled [m]."""
    yaw_weight: float = 0.4
    """Cost of turning [m/rad]: with the travelled distance [m] it is what the search minimises."""
    step_weight: float = 0.02
    """Cost of one foot's swing of the preferred length [m]."""
    stance_weight: float = 4.0
    """Cost of a foot away from its nominal place under the base, squared [1/m]."""
    stance_slack: float = 0.08
    """Deviation forward or backward that costs nothing, because a stance in mid-walk has it anyway [m]."""
    support_weight: float = 20.0
    """Cost of that distance during a swing, squared [1/m]."""
    twist_weight: float = 4.0
    """Cost of the two diagonals' mean heights differing, squared [1/m]."""
    rise_weight: float = 0.2
    """Cost of a foot's height difference between lift-off and touch-down [-]."""
    final_stance_weight: float = 5.0
    """Cost of the last stance's feet away from their nominal places, squared [1/m]."""
    heuristic_inflation: float = 2.0
    """Factor on the cost-to-go: above 1 the search is greedier, and its cost within that factor of the best."""

    max_expansions: int = 300
    """Most expanded nodes for one waypoint."""
    max_children: int = 24
    """Most children kept of one expansion, the best by cost plus cost-to-go."""
    time_limit: float = math.inf
    """Most wall-clock time of a search [s]. A finite one makes results depend on the machine; hits are reported."""

    def __post_init__(self):
        super().__post_init__()
        swing_gait(self.gait)
        if self.candidate not in CANDIDATES:
            raise UserInputError(f"candidate '{self.candidate}' is unknown; known: {', '.join(CANDIDATES)}")
        for name in ("max_steps", "max_expansions", "max_children", "candidates_per_leg"):
            if getattr(self, name) < 1:
                raise UserInputError(f"{name} must be at least 1, not {getattr(self, name)}")
        for name in ("local_radius", "goal_tolerance", "max_swing", "preferred_swing", "max_extension", "time_limit"):
            if not getattr(self, name) > 0.0:
                raise UserInputError(f"{name} must be positive, not {getattr(self, name)}")
        for name in ("reach_offset", "reach_semi_axes", "reach_exponents"):
            if len(getattr(self, name)) != 3:
                raise UserInputError(f"{name} needs three numbers, not {len(getattr(self, name))}")
        if self.max_support_distance < 0.0:
            raise UserInputError(f"max_support_distance must not be negative, is {self.max_support_distance}")
        if min(self.reach_semi_axes + self.reach_exponents) <= 0.0:
            raise UserInputError("reach_semi_axes and reach_exponents must be positive")
