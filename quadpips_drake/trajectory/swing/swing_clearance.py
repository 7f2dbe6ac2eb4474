"""Whether a swing clears the ground, by geometry alone: what the foothold search asks before anything is optimised.

A foot that stands at the foot of a barrier finds no way over it, whatever the optimiser does; a search that knows this takes
another foothold, where the optimiser could only refuse one plan after the other.
"""

from dataclasses import dataclass

from quadpips_drake.trajectory.swing.ground_profile import KnownGround
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizerConfig
from quadpips_drake.trajectory.swing.swing_trajectory import SwingSpline
from quadpips_drake.values.regions import GroundHeights, RegionSet


@dataclass(frozen=True, eq=False)
class SwingClearance:
    """Tests swings over one piece of ground."""

    ground: KnownGround
    foot_radius: float
    """[m]"""
    config: SwingOptimizerConfig
    """Its shape of swings, and how deep they may go through the ground."""

    @classmethod
    def over(
        cls, regions: RegionSet, heights: GroundHeights, foot_radius: float, config: SwingOptimizerConfig
    ) -> "SwingClearance":
        """The test for what is known of the ground."""
        return cls(KnownGround(tuple(regions.regions), heights), foot_radius, config)

    def __call__(self, duration: float, start, end) -> bool:
        """Whether an apex clears the ground for a swing of ``duration`` [s].

        Args:
            start, end: ground point in W [m] and upward normal where the foot leaves and where it lands, (3,) and (3,).
        """
        p0, p1 = (point + self.foot_radius * normal for point, normal in (start, end))
        profile = self.ground.profile(p0, p1, self.foot_radius)
        spline = SwingSpline.plan(0.0, duration, p0, p1, end[1], self.config.swing, liftoff_normal=start[1], profile=profile)
        return spline.depth <= self.config.max_depth
