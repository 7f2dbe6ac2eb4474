"""Configuration of the foothold search."""

import math

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.gaits.swing_gaits import swing_gait

CANDIDATES = ("nearest", "center")
STEPPABILITY = ("exclude", "penalty", "off")
CHOICES = {
    "candidate": CANDIDATES,
    "steppability": STEPPABILITY,
    "steppability_unknown": ("out_of_frame", "steppable", "passable", "non_passable"),
    "steppability_occluded": ("label", "out_of_frame"),
    "steppability_unseen": ("out_of_frame", "region"),
}
"""Known values of the keys that are words."""
MAX_STEPS = 32
MAX_EXPANSIONS = 20_000


@configuration
class FootholdConfig(StageConfig):
    """Settings of the foothold search (QuadPiPS section VI-C); the defaults suit ANYmal C."""

    rate: float = stage_rate(15.0)
    """How often it looks for a new torso path [Hz] (QuadPiPS: 15)."""

    gait: str = "standing_trot"
    """Order of the swings: standing_trot, slow_trot or standing_walk."""
    careful_gait: str = "standing_walk"
    """The gait on steep, narrow or uneven ground, after a failed plan and after an instability (levels 1 and 3)."""
    careful_rise: float = ranged(0.12, 0.0, 10.0)
    """The careful gait is taken when a foot would rise or sink by more than this in a swing [m] ..."""
    careful_roll: float = ranged(0.20, 0.0, 3.2)
    """... or the base roll by more than this from one stance to the next [rad] ..."""
    careful_width: float = ranged(0.14, 0.0, 10.0)
    """... or a stance be narrower than this, fore or hind [m]."""
    any_first_phase: bool = True
    """Whether a plan may begin with any phase of the gait; else always with the first."""
    any_order: bool = False
    """Whether the phases of the gait, and the single swings of the careful one, may come in any order."""
    free_below: float = ranged(0.0, 0.0, 20.0)
    """When the gait does not lead to the waypoint, and no further than this [m], swings in any order are tried at once, with
    the wider limits of escalation; 0: only after a failed plan."""
    max_steps: int = ranged(8, 1, MAX_STEPS)
    """Most swings in a plan: 8 are four cycles of a trot, two of a walk."""
    local_radius: float = ranged(1.25, 0.05, 20.0)
    """Radius around the torso within which the local waypoint is taken from the torso path [m] (1.25 in the release)."""
    goal_tolerance: float = ranged(0.12, 0.001, 10.0)
    """A plan is complete when it ends with the base this close to the waypoint, in xy [m] (the release: 0.25)."""
    goal_yaw_tolerance: float = ranged(0.25, 0.001, 4.0)
    """... and its yaw this close to the waypoint's [rad]."""
    min_progress: float = ranged(0.10, 0.0, 10.0)
    """A plan that does not reach its waypoint counts only if it gets at least this much nearer to it [m]."""
    waypoint_retries: int = ranged(1, 0, 100)
    """How often to try an earlier pose of the torso path when nothing leads to the waypoint."""

    candidate: str = "nearest"
    """Foothold of a region: "nearest" point of its inset to where the foot wants to go, or its "center" as in the paper."""
    candidates_per_leg: int = ranged(12, 1, 50)
    """Footholds kept for each swinging leg and expansion."""
    inward_pull: float = ranged(0.03, 0.0, 1.0)
    """How far beyond the nearest point of the inset a foothold is moved away from the edge [m]."""
    max_slope: float = ranged(0.60, 0.0, 1.5)
    """Steepest region that carries a foot [rad]."""

    reach_offset: list[float] = ranged([0.0, 0.02, 0.05], -2.0, 2.0)
    """Centre of the superquadric (eq. 15) from the nominal foot in B: forward, outward, up [m]."""
    reach_semi_axes: list[float] = ranged([0.42, 0.22, 0.28], 0.001, 5.0)
    """Semi-axes a, b, c of the superquadric [m]."""
    reach_exponents: list[float] = ranged([4.0, 4.0, 4.0], 0.5, 100.0)
    """Exponents d, e, f of the superquadric."""
    max_extension: float = ranged(0.98, 0.1, 1.0)
    """Longest leg at touch-down and lift-off, as a fraction of the straight one."""
    max_swing: float = ranged(0.55, 0.001, 5.0)
    """Longest way from lift-off to touch-down [m] (eq. 18)."""
    max_rise: float = ranged(0.25, 0.0, 5.0)
    """Largest height difference between lift-off and touch-down [m]."""
    length_tolerance: float = ranged(0.35, 0.0, 5.0)
    """Largest deviation of a stance's length, left or right, from the nominal one [m] (eq. 17)."""
    max_support_distance: float = ranged(0.10, 0.0, 5.0)
    """During a swing, largest distance from the base's mean position to where the feet on the ground support it [m]."""
    max_tilt: float = ranged(0.35, 0.0, 1.5)
    """Largest roll and pitch of the nominal base [rad]."""
    max_yaw_step: float = ranged(0.20, 0.0, 3.2)
    """Largest change of yaw that one swing aims for [rad]."""

    preferred_swing: float = ranged(0.30, 0.01, 5.0)
    """Length of a swing that costs least per distance travelled [m]."""
    yaw_weight: float = ranged(0.4, 0.0, 1000.0)
    """Cost of turning [m/rad]: with the travelled distance [m] it is what the search minimises."""
    step_weight: float = ranged(0.02, 0.0, 1000.0)
    """Cost of one foot's swing of the preferred length [m]."""
    stance_weight: float = ranged(6.0, 0.0, 1000.0)
    """Cost of a foot away from its nominal place under the base, squared [1/m]."""
    stance_slack: float = ranged(0.08, 0.0, 5.0)
    """Deviation forward or backward that costs nothing, because a stance in mid-walk has it anyway [m]."""
    support_weight: float = ranged(20.0, 0.0, 1000.0)
    """Cost of that distance during a swing, squared [1/m]."""
    twist_weight: float = ranged(4.0, 0.0, 1000.0)
    """Cost of the two diagonals' mean heights differing, squared [1/m]."""
    rise_weight: float = ranged(0.2, 0.0, 1000.0)
    """Cost of a foot's height difference between lift-off and touch-down [-]."""
    final_stance_weight: float = ranged(5.0, 0.0, 1000.0)
    """Cost of the last stance's feet away from their nominal places, squared [1/m]."""
    heuristic_inflation: float = ranged(4.0, 0.0, 100.0)
    """Factor on the cost-to-go: above 1 the search is greedier, and its cost within that factor of the best."""

    single_place: float = ranged(0.0, 0.0, 10.0)
    """A region whose inset reaches no further than this from its origin [m] is one place in the identity of a node, as in
    the paper; larger ones have places in cells of 2 cm."""
    max_expansions: int = ranged(150, 1, MAX_EXPANSIONS)
    """Most expanded nodes for one waypoint."""
    patience: float = ranged(0.4, 0.0, 1.0)
    """A search that has come no nearer to its waypoint for this part of ``max_expansions`` ends with the best stance that it
    found: waypoints at the edge of what is known are often not quite reached [1]. 1: it goes on to the bound."""
    max_children: int = ranged(24, 1, 1000)
    """Most children kept of one expansion, the best by cost plus cost-to-go."""
    time_limit: float = ranged(math.inf, 1e-9, math.inf)
    """Most wall-clock time of a search [s]. A finite one makes results depend on the machine; hits are reported."""

    steppability: str = "exclude"
    """What labels mean to the searches: "exclude" regions that are not steppable; a "penalty" on footholds by the newest
    label image, on regions of every label (Asselmeier et al., arXiv 2501.00112); "off": nothing."""
    steppability_weight: float = ranged(0.003, 0.0, 1000.0)
    """Cost of one unit of the penalty [m]: a foot on non-passable ground is 4995 of them, on passable ground 495, out of the
    frame 20."""
    steppability_unknown: str = "out_of_frame"
    """As what an unknown label counts in the penalty: out_of_frame, steppable, passable or non_passable."""
    steppability_occluded: str = "label"
    """How a foothold counts in the penalty that something hides: by the "label" of that, or as "out_of_frame"."""
    steppability_unseen: str = "out_of_frame"
    """How footholds out of the frame count in the penalty: as "out_of_frame", or by the label of their "region"."""

    @property
    def every_label(self) -> bool:
        """Whether regions of every label may carry a foot."""
        return self.steppability != "exclude"

    def __post_init__(self):
        super().__post_init__()
        swing_gait(self.gait)
        swing_gait(self.careful_gait)
        for key, known in CHOICES.items():
            if getattr(self, key) not in known:
                raise UserInputError(f"{key} '{getattr(self, key)}' is unknown; known: {', '.join(known)}")
