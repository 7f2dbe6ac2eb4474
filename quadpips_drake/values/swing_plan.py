"""What the swing optimiser made of a foothold plan."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import RefusedSwing
from quadpips_drake.values.reference import WholeBodyReference


@dataclass(frozen=True, eq=False)
class SwingReport:
    """How one swing went."""

    legs: tuple
    status: str
    """"converged", "unconverged" (used all the same), or why there is no motion for this swing."""
    iterations: int = 0
    cost: float = np.nan
    constraint_violation: float = np.nan
    landing_error: float = np.nan
    """Largest distance of a swung foot from its foothold [m]."""
    elapsed: float = 0.0
    """Wall-clock time [s]."""
    number: int = 0
    """Which swing of the plan it is, from 0 on."""

    @property
    def used(self) -> bool:
        return self.status in ("converged", "unconverged")


@dataclass(frozen=True, eq=False)
class SwingPlan(ImmutableValue):
    """A whole-body reference, its times relative to its start, and how it came about."""

    reference: WholeBodyReference
    """Without samples when not even the first swing was possible."""
    reports: tuple = ()
    """One SwingReport for each swing of the reference, in order, and at last those of attempts that failed."""
    planned: int = 0
    """Swings in the foothold plan."""
    refined: bool = False
    """Whether the swings were smoothed together."""
    refinement_time: float = 0.0
    """Wall-clock time of that [s]."""
    reason: str = ""
    """Why the reference ends before the foothold plan does; empty when it does not."""
    refused: RefusedSwing | None = None
    """The swing that no motion was found for; the reference ends at rest before it, or earlier."""

    @property
    def success(self) -> bool:
        return len(self.reference.times) > 1

    @property
    def elapsed(self) -> float:
        """Wall-clock time of all swings and their refinement [s]."""
        return sum(report.elapsed for report in self.reports) + self.refinement_time

    @staticmethod
    def empty() -> "SwingPlan":
        """Before the first foothold plan."""
        return SwingPlan.without_motion(-np.inf)

    @staticmethod
    def without_motion(stamp: float, request_id: int = 0, reason: str = "", **fields) -> "SwingPlan":
        """The answer to a request that led to no motion, and why."""
        return SwingPlan(replace(WholeBodyReference.empty(stamp), request_id=request_id), reason=reason, **fields)
