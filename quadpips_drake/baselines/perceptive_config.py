"""Settings of the walk whose footholds are projected onto regions."""

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig


@configuration
class PerceptiveReferenceConfig(VelocityReferenceConfig):
    """How a velocity command becomes a reference that steps on regions; what the walk by velocity has, and more.

    Numbers of OCS2's perceptive example, where it has them.
    """

    settled_phase: float = ranged(1.0, 0.0, 1.0)
    """Part of a swing after which its foothold is not moved any more, 0..1 [1]; here ``freeze_time`` decides."""

    freeze_time: float = ranged(0.25, 0.0, 10.0)
    """From so long before touch-down on a foothold stays where it is [s] (OCS2: 0.25)."""
    dead_zone: float = ranged(0.05, 0.0, 1.0)
    """A wish for a foothold that is closer than this to the last one does not move it [m] (OCS2: 0.05)."""
    filter_part: float = ranged(0.333, 0.0, 1.0)
    """Else it moves, but this part of the last wish remains [1] (OCS2: 0.333)."""

    region_rate: float = ranged(20.0, 0.001, 10_000.0)
    """How often it looks at the regions [Hz] (QuadPiPS: superpixels at 20)."""
    search_radius: float = ranged(0.5, 0.001, 10.0)
    """Regions farther from where the foot wants to go are none to step on [m]."""
    max_slope: float = ranged(0.60, 0.0, 1.5)
    """Steepest region that carries a foot [rad]; the planner's of QuadPiPS."""
    penalty_weight: float = ranged(5.0, 0.0, 1e6)
    """Weight of the squares of instep and over-extension beside the squared distance to a region [1] (OCS2: 5)."""
    max_extension: float = ranged(0.90, 0.1, 1.0)
    """Longest leg that costs nothing, from HFE to foot, as part of the straight one [1] (OCS2: 0.55 m, 0.90 of ANYmal's)."""
    polygon_vertices: int = ranged(16, 3, 64)
    """Of the polygon in which the MPC may put a foot down [1] (OCS2: 16)."""
    polygon_growth: float = ranged(1.05, 1.001, 2.0)
    """Factor by which its vertices move outward at a time [1] (OCS2: 1.05)."""

    max_tilt: float = ranged(0.35, 0.0, 1.5)
    """Largest roll and pitch of the base reference [rad]; the planner's of QuadPiPS."""
    smoothing_time: float = ranged(0.4, 0.0, 10.0)
    """Height, roll and pitch of the base are means over so long a time around each moment [s]: a step under one foot is no
    jump."""

    clear_ground: bool = False
    """Whether swings rise over what lies between lift-off and touch-down, by the map of heights where there is one and by
    regions elsewhere; else only over the region that they land on."""
    max_apex_height: float = ranged(0.16, 0.0, 5.0)
    """What is higher than this over the straight way counts as no higher [m]: twice the swing height."""

    learned: bool = False
    """Whether a network that imitates our foothold search moves each wish before it is projected."""
    learned_model: str = ""
    """Directory of that network, as 'quadpips learned-footholds train' writes it; empty: that of the package."""
    max_offset: float = ranged(0.20, 0.0, 1.0)
    """By how much the network moves a wish at most [m]."""
