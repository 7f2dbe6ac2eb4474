"""Values that planning passes on: a request, a torso path, a sequence of stances."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.regions import RegionSet

_NOTHING_ASKED = "nothing was asked for yet"


@dataclass(frozen=True, eq=False)
class PlanRequest(ImmutableValue):
    """A wish for a new plan; stages plan once for each new ``id``. The id 0 asks for nothing."""

    id: int
    stamp: float
    """Time of the request [s]."""
    goal: np.ndarray
    """Goal of the torso in the world, xy [m], shape (2,)."""

    @staticmethod
    def empty() -> "PlanRequest":
        """Asks for nothing."""
        return PlanRequest(0, -np.inf, np.zeros(2))


@dataclass(frozen=True, eq=False)
class TorsoPath(ImmutableValue):
    """Result of the torso search (QuadPiPS section VI-B); frame W."""

    stamp: float
    request_id: int
    poses: np.ndarray
    """x, y, z [m], yaw [rad] of the torso from the start on, shape (n, 4); n = 0 when nothing was found."""
    regions: RegionSet
    """The RegionSet that was searched."""
    reason: str = ""
    """Empty when a path was found; else why not."""

    @staticmethod
    def empty() -> "TorsoPath":
        """Before the first request."""
        return TorsoPath(-np.inf, 0, np.zeros((0, 4)), RegionSet.empty(), _NOTHING_ASKED)

    @property
    def success(self) -> bool:
        return len(self.poses) > 0


@dataclass(frozen=True, eq=False)
class Stance(ImmutableValue):
    """All four feet on the ground, as the end of one transition of the foothold plan; frame W."""

    footholds: np.ndarray
    """Ground point under each foot [m], (4, 3)."""
    normals: np.ndarray
    """Upward unit normal of the ground under each foot, (4, 3)."""
    regions: tuple
    """The PlanarRegion under each foot, four of them (a small made-up one, id < 0, where none was seen)."""
    p_WB: np.ndarray
    """Nominal position of the base above this stance [m], (3,)."""
    rpy_WB: np.ndarray
    """Nominal roll, pitch, yaw of the base [rad], (3,)."""


@dataclass(frozen=True, eq=False)
class FootholdPlan(ImmutableValue):
    """Result of the foothold search (QuadPiPS section VI-C): stances joined by swings of the gait; frame W.

    ``stances[0]`` is where the robot stands; the swing ``k`` leads from ``stances[k]`` to ``stances[k + 1]`` and moves the
    legs in ``swing_legs[k]``.
    """

    stamp: float
    request_id: int
    stances: tuple = ()
    swing_legs: tuple = ()
    """One tuple of Leg for each swing."""
    gait: str = ""
    swing_duration: float = 0.0
    """Time of a swing [s]; 0 in a plan without any, as the next."""
    stance_duration: float = 0.0
    """Time with all feet down between swings [s]."""
    waypoint: np.ndarray | None = None
    """Torso waypoint that the search aimed at, x, y, z [m], yaw [rad], (4,)."""
    reason: str = ""
    """Empty when a plan was found; else why not."""
    expansions: int = 0
    elapsed: float = 0.0
    """Wall-clock time of the search [s]."""
    complete: bool = True
    """Whether the last stance is at the waypoint; else it is as near as the steps of one plan led."""
    time_limit_hit: bool = False
    """Whether the wall-clock limit cut the search short."""

    @staticmethod
    def empty() -> "FootholdPlan":
        """Before the first torso path."""
        return FootholdPlan(-np.inf, 0, reason=_NOTHING_ASKED)

    @property
    def success(self) -> bool:
        return len(self.stances) > 1


@dataclass(frozen=True, eq=False)
class StageStatus(ImmutableValue):
    """What became of one request in a stage that reports failures apart from its result."""

    stamp: float
    request_id: int
    """The request that this is about; 0 before the first."""
    ok: bool
    reason: str = ""
    """Why not; empty when ok."""

    @staticmethod
    def empty() -> "StageStatus":
        """Before the first request."""
        return StageStatus(-np.inf, 0, True)


@dataclass(frozen=True, eq=False)
class MonitorStatus(ImmutableValue):
    """What the replan monitor makes of the situation."""

    stamp: float
    phase: str
    """standing_up, pausing, planning, walking, recovering, goal_reached or no_plan."""
    reason: str = ""
    """Why it is in this phase, in words."""
    replans: int = 0
    """Plans asked for after the first."""
    aborts: int = 0
    """References given up because the robot became unstable."""
    failed_plans: int = 0
    """Requests that ended without a reference."""
    distance_to_goal: float = float("nan")
    """Of the base, in xy [m]."""

    @staticmethod
    def empty() -> "MonitorStatus":
        """Before the monitor looked for the first time."""
        return MonitorStatus(-np.inf, "standing_up")
