"""What the swing optimiser made of a foothold plan, and what is remembered of such attempts."""

from dataclasses import dataclass, field, replace
from enum import IntEnum

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


class SwingOutcome(IntEnum):
    """What became of a swing that was tried."""

    CONVERGED = 0
    UNCONVERGED = 1
    """A motion was found that is not the best one."""
    FAILED = 2
    """There is none, or it met something on its way."""


@dataclass(frozen=True, eq=False)
class ExperienceLibrary(ImmutableValue):
    """What became of the transitions that were tried so far: n records, each of all attempts at one of them.

    With the scope "site" footholds are in W, of one terrain; with "general" they are in the heading frame H of the stance
    before: origin in the middle of its feet, z up, x from the middle of the hind feet to that of the fore feet.
    """

    scope: str = "general"
    """site or general."""
    robot: str = ""
    """Whose transitions."""
    configuration: str = ""
    """Hash of what the costs depend on."""
    site: str = ""
    """Fingerprint of the terrain; empty with the scope "general"."""
    trials: int = 0
    """Plans of which swings were learned so far: its clock."""
    phase: np.ndarray = field(default_factory=lambda: np.zeros(0, np.uint8))
    """Phase of the gait in which they swing, uint8 (n,)."""
    legs: np.ndarray = field(default_factory=lambda: np.zeros(0, np.uint8))
    """The legs that swing, as bits (1 << leg), uint8 (n,)."""
    before: np.ndarray = field(default_factory=lambda: np.zeros((0, 4, 3)))
    """Ground points of all feet before [m], (n, 4, 3) ..."""
    after: np.ndarray = field(default_factory=lambda: np.zeros((0, 4, 3)))
    """... and after [m], (n, 4, 3)."""
    count: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    """Attempts, int64 (n,)."""
    cost: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Their mean optimal cost above that of an easy swing, at least 0; a failed one costs ``failure_cost``; (n,)."""
    status: np.ndarray = field(default_factory=lambda: np.zeros(0, np.uint8))
    """SwingOutcome of the last attempt, uint8 (n,)."""
    last: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    """When that was, in ``trials``, int64 (n,)."""

    def __len__(self) -> int:
        return len(self.count)

    @staticmethod
    def empty() -> "ExperienceLibrary":
        """Nothing was tried yet."""
        return ExperienceLibrary()
