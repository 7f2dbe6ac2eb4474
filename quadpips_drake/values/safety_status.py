"""Whether the robot is in trouble, as the safety monitor tells everybody else."""

import math
from dataclasses import dataclass

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
