"""What newer knowledge of the ground says against a reference that is being followed (QuadPiPS VII-A; 003, section 4.3).

A foothold that is coming is lost when the ground there is now known to be higher or lower than planned, or when it is seen
but in no region that may carry a foot any more. A swing is blocked by ground above all that it was planned to clear, the way
of the torso by ground that reaches up to its belly. Each has to be so in several region sets in a row.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.planning.region_table import in_convex_polygon
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.robot_shapes import load_robot_shapes
from quadpips_drake.trajectory.swing.ground_profile import SAMPLES, KnownGround
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.steppability import Steppability

FOOTHOLD_LOST, SWING_BLOCKED, WAY_BLOCKED = "foothold_lost", "swing_blocked", "way_blocked"
_SEEN = 0.5
"""Part of the cells under a foot that have to be known for a verdict [1]."""
_ENDS = 4
"""So many of a swing's samples at either end lie on its footholds."""
_WAY_STEP = 0.1
"""Between two looks at the way of the torso [s]."""
_BODY_GRID = np.stack(np.meshgrid(np.linspace(-1, 1, 7), np.linspace(-1, 1, 5), indexing="ij"), axis=-1).reshape(-1, 2)
"""Points under the body, in half lengths and half widths, (35, 2)."""
_BODY_POINTS = 2
"""So many of them must be too high: one alone may be noise."""


@configuration
class GroundEventConfig:
    """When newer knowledge of the ground counts against the reference."""

    region_sets: int = ranged(3, 0, 1000)
    """In so many successive region sets, as the monitor sees them, it has to say the same [1]; 0: never."""
    height_change: float = ranged(0.03, 0.001, 1.0)
    """A foothold is lost when the ground there is so much higher or lower than planned [m]."""
    region_tolerance: float = ranged(0.03, 0.0, 1.0)
    """A foothold this far outside a region, or above or below it, is still in it [m]."""
    body_clearance: float = ranged(0.03, -1.0, 1.0)
    """Ground that comes so near to the belly of the torso blocks its way [m]."""


class Extent(NamedTuple):
    """How large a robot is."""

    foot_radius: float
    """[m]"""
    half_body: np.ndarray
    """Half length and half width of the torso between the hips [m], (2,)."""
    belly: float
    """How far the torso reaches down below the base's origin [m]."""


@dataclass(frozen=True)
class Problem:
    """What speaks against a reference."""

    kind: str
    """FOOTHOLD_LOST, SWING_BLOCKED or WAY_BLOCKED."""
    key: tuple
    """The same as long as it is about the same thing."""
    before: float
    """When the robot has to stand at the latest [s]."""
    words: str


@dataclass(frozen=True, eq=False)
class Doubts(ImmutableValue):
    """In how many region sets in a row there have been which problems."""

    stamp: float = -np.inf
    """Of the last set that was looked at [s]."""
    counts: tuple = ()
    """((key, count), ...)."""


class Places:
    """Where a foot may stand."""

    def __init__(self, regions: RegionSet):
        self._regions = [r for r in regions.regions if r.label in (Steppability.UNKNOWN, Steppability.STEPPABLE)]
        self._origins = np.array([region.X_WR[:3, 3] for region in self._regions]).reshape(-1, 3)

    def hold(self, point: np.ndarray, tolerance: float) -> bool:
        """Whether a region contains ``point`` (3,) in W, or is ``tolerance`` [m] away from it at most."""
        for k in np.argsort(np.linalg.norm(self._origins - point, axis=1), kind="stable"):  # the nearest one mostly does
            region = self._regions[k]
            local = (point - self._origins[k]) @ region.X_WR[:3, :3]
            if abs(local[2]) <= tolerance and in_convex_polygon(local[:2], region.boundary, tolerance):
                return True
        return False


@cache
def extent_of(robot: RobotModel) -> Extent:
    """The Extent of a robot, its torso as the perception role shows it."""
    shapes = load_robot_shapes(robot)
    down = np.abs(shapes.R_LG[:, 2] * shapes.half_size).sum(axis=1) + shapes.rounding - shapes.p_LG[:, 2]
    half_body = np.abs(robot.hip_positions_B[:, :2]).max(axis=0)
    return Extent(float(robot.foot_radius), half_body, float(down[shapes.link == 0].max()))


def confirmed_problem(
    doubts: Doubts, problems: list[Problem], stamp: float, config: GroundEventConfig
) -> tuple[Doubts, Problem | None]:
    """Returns the memory after a region set of the time ``stamp``, and the most urgent problem that is certain by now."""
    if not stamp > doubts.stamp:
        return doubts, None
    before = dict(doubts.counts)
    counts = {problem.key: before.get(problem.key, 0) + 1 for problem in problems}
    certain = [problem for problem in problems if counts[problem.key] >= config.region_sets]
    return Doubts(stamp, tuple(counts.items())), min(certain, key=lambda problem: problem.before, default=None)


def find_problems(
    reference: WholeBodyReference,
    time: float,
    regions: RegionSet,
    ground: GroundHeights,
    feet: np.ndarray,
    extent: Extent,
    config: GroundEventConfig,
) -> list[Problem]:
    """Returns what speaks against the rest of ``reference``, in which the robot can still stop before it.

    Args:
        reference: what is being followed.
        time: now [s].
        regions: the newest ones.
        ground: the newest map; where it knows nothing, nothing is said.
        feet: where the feet are, their centres in W [m], (4, 3).
        extent: of the robot.
        config: what counts.
    """
    problems, starts, places = [], {}, Places(regions)
    for foothold in reference.footholds:
        start, starts[foothold.leg] = starts.get(foothold.leg, feet[foothold.leg]), foothold.position
        if foothold.liftoff_time <= time:
            continue
        place = (int(foothold.leg), round(foothold.touchdown_time, 3))
        where = f"{foothold.leg.name} at ({foothold.position[0]:.2f}, {foothold.position[1]:.2f})"
        words = foothold_problem(foothold, places, ground, extent.foot_radius, config)
        if words:
            problems.append(Problem(FOOTHOLD_LOST, (FOOTHOLD_LOST, *place), foothold.liftoff_time, f"{where}: {words}"))
        height = obstacle_on_swing(start, foothold, ground, extent.foot_radius, config)
        if height is not None:
            words = f"{where}: ground {height:.2f} m higher than the swing"
            problems.append(Problem(SWING_BLOCKED, (SWING_BLOCKED, *place), foothold.liftoff_time, words))
    blocked = obstacle_on_way(reference, time, ground, extent, config)
    if blocked is not None:
        words = f"ground as high as the torso's belly {blocked - time:.1f} s ahead"
        problems.append(Problem(WAY_BLOCKED, (WAY_BLOCKED,), blocked, words))
    return problems


def foothold_problem(foothold, regions: Places, ground: GroundHeights, radius: float, config: GroundEventConfig) -> str:
    """Says why a foot of ``radius`` [m] cannot come down on a FootholdTarget as planned; empty if it can."""
    point = foothold.position - radius * foothold.normal
    offsets = _disc(radius, ground.cell)
    heights = ground.at(*(point[:2] + offsets).T)
    known = np.isfinite(heights)
    if known.sum() < _SEEN * len(heights):
        return ""
    above = heights - (point[2] - offsets @ foothold.normal[:2] / foothold.normal[2])
    change = float(np.median(above[known]))
    if abs(change) > config.height_change:
        return f"the ground is {abs(change):.2f} m {'higher' if change > 0 else 'lower'} than planned"
    was_seen = foothold.region is not None and foothold.region.id >= 0
    if was_seen and not regions.hold(point, config.region_tolerance):
        return "in no region any more"
    return ""


def obstacle_on_swing(
    start: np.ndarray, foothold, ground: GroundHeights, radius: float, config: GroundEventConfig
) -> float | None:
    """By how much ground on the way of a swing is higher than all that it was planned to clear [m]; None if it is not."""
    if foothold.profile is None or len(foothold.profile) != SAMPLES or not ground.height.size:
        return None
    parts = np.linspace(0.0, 1.0, SAMPLES)
    straight = start[2] + parts * (foothold.position[2] - start[2]) + foothold.apex_height
    now = KnownGround((), ground).profile(start, foothold.position, radius)
    excess = float((now - np.maximum(foothold.profile, straight))[_ENDS:-_ENDS].max())
    return excess if excess > config.height_change else None


def obstacle_on_way(
    reference: WholeBodyReference, time: float, ground: GroundHeights, extent: Extent, config: GroundEventConfig
) -> float | None:
    """When the torso will first be above ground that it cannot pass over [s]; None if it never will.

    What it is above now is no obstacle: it stands there.
    """
    ahead = np.flatnonzero(reference.times > time)
    if not len(ahead) or not ground.height.size:
        return None
    step = max(1, round(_WAY_STEP / max(float(np.diff(reference.times).mean()), 1e-6))) if len(reference.times) > 1 else 1
    states = reference.states[ahead[::step]]
    base, yaw = states[:, CentroidalState.POSITION], states[:, CentroidalState.YAW]
    points = [
        p[:2] + (_BODY_GRID * extent.half_body) @ yaw_matrix(turn)[:2, :2].T for p, turn in zip(base, yaw, strict=True)
    ]
    heights = ground.at(*np.concatenate(points).T).reshape(len(base), -1)
    limit = base[:, 2] - extent.belly - config.body_clearance
    blocked = (heights > limit[:, None]).sum(axis=1) >= _BODY_POINTS
    if blocked[0] or not blocked.any():
        return None
    return float(reference.times[ahead[::step]][np.argmax(blocked)])


@cache
def _disc(radius: float, cell: float) -> np.ndarray:
    """Offsets of the middles of cells within ``radius`` [m] of a point, (n, 2)."""
    steps = cell * np.arange(-np.floor(radius / cell), np.floor(radius / cell) + 1)
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    return grid[np.hypot(*grid.T) <= radius]
