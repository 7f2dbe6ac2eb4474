"""Values that planning passes on: a request, a torso path, a sequence of stances."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS
from quadpips_drake.values.regions import RegionSet

_NOTHING_ASKED = "nothing was asked for yet"


@dataclass(frozen=True, eq=False)
class PlanStart(ImmutableValue):
    """Where a plan begins that is made while another one is followed: a moment of that one with all feet down."""

    follows: int
    """Request id of the reference that leads there."""
    time: float
    """When [s]."""
    state: np.ndarray
    """State of the centroidal model there, as WholeBodyReference has it, (24,)."""


@dataclass(frozen=True, eq=False)
class PlanRequest(ImmutableValue):
    """A wish for a new plan; stages plan once for each new ``id``. The id 0 asks for nothing."""

    id: int
    stamp: float
    """Time of the request [s]."""
    goal: np.ndarray
    """Goal of the torso in the world, xy [m], shape (2,)."""
    start: PlanStart | None = None
    """Where the plan begins; None: where the robot is."""
    level: int = 0
    """How hard to try, from 0 on: one more for each failure in a row."""
    appeared: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Points of ground that has risen since it was first seen, which no foot shall stand on; in W [m], (n, 3)."""
    keep_off: float = 0.0
    """How far feet stay away from them [m]."""

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
    level: int = 0
    """Of escalation, as requested."""
    to_goal: bool = True
    """Whether it ends at the goal; else at a sub-goal that is nearer or shows more."""
    viewpoints: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Where the robot stood when it planned for this goal, x, y [m], yaw [rad], shape (k, 3): what it counts as seen."""
    start: PlanStart | None = None
    """That of the request ..."""
    appeared: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """... and what it says has appeared, points in W [m], (k, 3): regions leave it out, swings keep a margin to it."""
    nodes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Positions of the base over which the search had poses with ground for all legs [m], (k, 3)."""
    reached: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    """Whether it came to each of them, bool (k,)."""

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
class RefusedSwing(ImmutableValue):
    """A transition of a foothold plan that no motion was found for; frame W."""

    legs: tuple
    """The Legs that were to swing."""
    start: np.ndarray
    """Ground points of all feet before it [m], (4, 3)."""
    end: np.ndarray
    """... and after it [m], (4, 3)."""
    reason: str = ""
    """Why not, in words."""


@dataclass(frozen=True, eq=False)
class RefusedSwings(ImmutableValue):
    """Transitions that a foothold search shall do without."""

    request_id: int = 0
    """The request whose plan they were found in last."""
    swings: tuple = ()
    """RefusedSwings."""
    appeared: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Points in W [m], (n, 3), of what no swing shall lead over."""

    @staticmethod
    def empty() -> "RefusedSwings":
        """Nothing is refused."""
        return RefusedSwings()


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
    start: PlanStart | None = None
    """That of the request: where ``stances[0]`` comes from."""
    gait_reason: str = ""
    """Why the gait is not the usual one."""
    considered: int = 0
    """Stances that the search for this waypoint looked at [1]."""
    refusals: dict = field(default_factory=dict)
    """How many of them each constraint refused: {constraint: count}."""
    cost: float = 0.0
    """Of the way to the last stance, as the search counts [m]."""

    @staticmethod
    def empty() -> "FootholdPlan":
        """Before the first torso path."""
        return FootholdPlan(-np.inf, 0, reason=_NOTHING_ASKED)

    @property
    def success(self) -> bool:
        return len(self.stances) > 1

    def sketch(self) -> "PlanSketch":
        """What there is to draw of it."""
        if not self.success:
            return PlanSketch(self.stamp, self.request_id)
        return PlanSketch(
            stamp=self.stamp,
            id=self.request_id,
            points=np.concatenate([stance.footholds for stance in self.stances]),
            normals=np.concatenate([stance.normals for stance in self.stances]),
            legs=np.tile(np.arange(NUM_LEGS), len(self.stances)),
            waypoint=None if self.waypoint is None else self.waypoint[:3],
        )


@dataclass(frozen=True, eq=False)
class PlanSketch(ImmutableValue):
    """What there is to draw of a plan, whoever made it; frame W."""

    stamp: float
    """Time of the plan [s]."""
    id: int = 0
    """A new one for each plan."""
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Ground points of planned footholds [m], (n, 3)."""
    normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Upward unit normals of the ground there, (n, 3)."""
    legs: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    """The Leg of each, int (n,)."""
    waypoint: np.ndarray | None = None
    """Where the plan leads the base [m], (3,)."""

    @staticmethod
    def empty() -> "PlanSketch":
        """There is no plan yet."""
        return PlanSketch(-np.inf)
