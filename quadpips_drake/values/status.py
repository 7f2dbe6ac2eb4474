"""What stages tell each other about how they are doing: the safety monitor, a planner, one stage of a planner."""

import math
from dataclasses import dataclass, field
from enum import StrEnum

from quadpips_drake.values.immutable import ImmutableValue

SAFETY_EVENTS = ("attitude", "joint_speed", "torque", "slip", "contact")
"""What makes a robot count as unstable (QuadPiPS section VII-A, with slip and contact mismatch added)."""


@dataclass(frozen=True, eq=False)
class SafetyStatus(ImmutableValue):
    """Verdict of the safety monitor."""

    stamp: float
    """[s]"""
    unstable: bool = False
    """True from an event until the robot has come to rest; nothing should be followed meanwhile."""
    event: str = ""
    """The last event's name, one of SAFETY_EVENTS; empty before the first."""
    reason: str = ""
    """What was measured then, in words."""
    counts: tuple[int, ...] = (0,) * len(SAFETY_EVENTS)
    """How often each event has made the robot unstable so far."""
    at_rest: bool = True
    """Whether the robot is upright and hardly moves at this moment."""

    def counts_by_event(self) -> dict[str, int]:
        """The counts by name, those of events that have happened."""
        return {event: count for event, count in zip(SAFETY_EVENTS, self.counts, strict=True) if count}

    @staticmethod
    def empty() -> "SafetyStatus":
        """All is well: what a stage assumes that nobody tells."""
        return SafetyStatus(-math.inf)


@dataclass(frozen=True, eq=False)
class StageStatus(ImmutableValue):
    """What became of one request in a stage that reports failures apart from its result."""

    stamp: float
    request_id: int
    """The request that this is about; 0 before the first."""
    ok: bool
    reason: str = ""
    """Why not; empty when ok."""
    fallbacks: int = 0
    """How often a fallback had to do in this stage, over all requests."""

    @staticmethod
    def empty() -> "StageStatus":
        """Before the first request."""
        return StageStatus(-math.inf, 0, True)


class PlannerPhase(StrEnum):
    """What a planner is about, whatever kind it is."""

    STANDING_UP = "standing_up"
    PAUSING = "pausing"
    PLANNING = "planning"
    WALKING = "walking"
    RECOVERING = "recovering"
    GOAL_REACHED = "goal_reached"
    NO_PLAN = "no_plan"

    @property
    def number(self) -> int:
        """Its place in this list, from 0 on: how logs name it."""
        return list(PlannerPhase).index(self)


@dataclass(frozen=True, eq=False)
class PlannerStatus(ImmutableValue):
    """What a planner makes of the situation: all that trials, judges, logs and recordings know about it."""

    stamp: float
    """[s]"""
    phase: PlannerPhase
    """In ``NO_PLAN`` it has given up, which ends a trial."""
    reason: str = ""
    """Why it is in this phase, in words."""
    replans: int = 0
    """Plans asked for after the first."""
    fallbacks: dict = field(default_factory=dict)
    """How often what has happened so far that should not: {name: count}."""
    events: dict = field(default_factory=dict)
    """How often what has happened so far that called for another plan: {name: count}."""
    distance_to_goal: float = math.nan
    """Of the base, in xy [m]."""
    escalation: int = 0
    """How hard the last plan was tried: one level for each failure before it that is not yet outweighed by a success."""

    @property
    def gave_up(self) -> bool:
        """Whether there will be no plan any more."""
        return self.phase == PlannerPhase.NO_PLAN

    @staticmethod
    def empty() -> "PlannerStatus":
        """Before the planner looked for the first time."""
        return PlannerStatus(-math.inf, PlannerPhase.STANDING_UP)


@dataclass(frozen=True, eq=False)
class PlannerReport(ImmutableValue):
    """What a planner says about itself beside its status, for result.json."""

    stamp: float
    """[s]"""
    facts: dict = field(default_factory=dict)
    """Names and plain data: numbers, texts, lists and dictionaries of these."""

    @staticmethod
    def empty() -> "PlannerReport":
        """It has nothing to say yet."""
        return PlannerReport(-math.inf)
