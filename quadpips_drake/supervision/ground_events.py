"""What newer knowledge of the ground says against a reference that is being followed (QuadPiPS VII-A; 003, section 4.3).

A foothold that is coming is lost when the ground there is now known to be higher or lower than planned, or when it is seen
but in no region that may carry a foot any more. A swing is blocked by ground above all that it was planned to clear, the way
of the torso by ground that reaches up to its belly. Each has to be so in several region sets in a row.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.planning.region_table import in_convex_polygon
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.robot_shapes import trunk_corners
from quadpips_drake.trajectory.swing.ground_profile import PARTS, SAMPLES, ground_profile
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, PlanarRegion, RegionSet
from quadpips_drake.values.steppability import Steppability

FOOTHOLD_LOST, SWING_BLOCKED, WAY_BLOCKED = "foothold_lost", "swing_blocked", "way_blocked"
_SEEN = 0.5
"""Part of the cells under a foot that have to be known for a verdict [1]."""
_BESIDE, _TOUCHED = 0.02, 0.05
"""A foot does not come down where more than this part [1] of the cells under it and so far beside it [m] has risen."""
_ENDS = 4
"""So many of a swing's samples at either end lie on its footholds."""
_WAY_STEP = 0.1
"""Between two looks at the way of the torso [s]."""
_BODY_GRID = np.stack(np.meshgrid(np.linspace(0, 1, 33), np.linspace(0, 1, 5), indexing="ij"), axis=-1).reshape(-1, 2)
"""Points under the body, in lengths and widths from its hind right corner, (165, 2): of a wall only the face is seen."""
_AROUND = 0.6
"""So far around a place it is looked for what has appeared there [m]."""
_BODY_POINTS = 2
"""So many of them must be too high: one alone may be noise."""
_NOTHING = np.zeros((0, 3))
_ROUNDING = 1e-9
"""Distances that are computed in two ways differ by less [m]."""


@configuration
class GroundEventConfig:
    """When newer knowledge of the ground counts against the reference."""

    region_sets: int = ranged(3, 0, 1000)
    """In so many successive region sets, as the monitor sees them, it has to say the same [1]; 0: never."""
    height_change: float = ranged(0.03, 0.001, 1.0)
    """A foothold is lost when the ground there is so much higher or lower than planned [m]."""
    region_tolerance: float = ranged(0.03, 0.0, 1.0)
    """A foothold this far outside a region, or above or below it, is still in it [m]."""
    keep_off: float = ranged(0.25, 0.0, 10.0)
    """Feet stay so far away from ground that has risen [m]: far enough to walk round it rather than to step over it."""
    keep_off_least: float = ranged(0.14, 0.0, 10.0)
    """... and so far when a plan has failed: shanks lean, and a swing has to rise over it from there [m]."""
    body_clearance: float = ranged(0.03, -1.0, 1.0)
    """Ground that comes so near to the belly of the torso blocks its way [m]."""


class Extent(NamedTuple):
    """How large a robot is."""

    foot_radius: float
    """[m]"""
    hind_right: np.ndarray
    """x, y of the torso's hind right corner in the base frame B [m], (2,)."""
    fore_left: np.ndarray
    """... and of its fore left one, (2,)."""
    belly: float
    """How far the torso reaches down below the base's origin [m]."""

    @property
    def under_body(self) -> np.ndarray:
        """Points under the whole torso, x, y in B [m], (165, 2)."""
        return self.hind_right + _BODY_GRID * (self.fore_left - self.hind_right)


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
    place: tuple[float, float] | None = None
    """x, y of what it is about [m]; None where that is no one place."""


@dataclass(frozen=True, eq=False)
class Doubts(ImmutableValue):
    """In how many region sets in a row there have been which problems."""

    stamp: float = -np.inf
    """Of the last set that was looked at [s]."""
    counts: tuple = ()
    """((key, count), ...)."""


class Places:
    """Where a foot may stand."""

    def __init__(self, regions: RegionSet, every_label: bool = False):
        """``every_label``: whether labels forbid nothing."""
        self._labels = tuple(Steppability) if every_label else (Steppability.UNKNOWN, Steppability.STEPPABLE)
        self._regions = [region for region in regions.regions if region.label in self._labels]
        self._poses = np.array([region.X_WR for region in self._regions]).reshape(-1, 4, 4)

    def watch(self, region: PlanarRegion | None) -> bool:
        """Whether a foothold in ``region`` must stay in one: not if nobody saw it or its label was no reason against it."""
        return region is not None and region.id >= 0 and region.label in self._labels

    def hold(self, points: np.ndarray, tolerance: float) -> np.ndarray:
        """Which ``points`` (n, 3) in W a region contains, or is ``tolerance`` [m] away from at most, bool (n,)."""
        if not self._regions:
            return np.zeros(len(points), dtype=bool)
        away = points[:, None] - self._poses[:, :3, 3]
        distances = np.einsum("nki,nki->nk", away, away)
        height = np.einsum("nki,ki->nk", away, self._poses[:, :3, 2])
        distances[np.abs(height) > tolerance + _ROUNDING] = np.inf
        return np.array([self._holds(*pair, tolerance) for pair in zip(away, distances, strict=True)])

    def _holds(self, away: np.ndarray, distances: np.ndarray, tolerance: float) -> bool:
        """Args: from the regions' origins to a point, (k, 3), and how far that is; inf for regions that do not come near."""
        for k in _nearest_first(distances):
            region = self._regions[k]
            local = away[k] @ region.X_WR[:3, :3]
            if abs(local[2]) <= tolerance and in_convex_polygon(local[:2], region.boundary, tolerance):
                return True
        return False


def _nearest_first(distances: np.ndarray) -> Iterator[int]:
    """Indices of all finite ``distances`` (k,) in their order; the first, which is mostly enough, without sorting."""
    nearest = int(distances.argmin())
    if np.isfinite(distances[nearest]):
        yield nearest
        others = np.argsort(distances, kind="stable")
        yield from (int(k) for k in others[np.isfinite(distances[others])] if k != nearest)


@cache
def extent_of(robot: RobotModel) -> Extent:
    """The Extent of a robot, its torso as the perception role shows it."""
    corners = trunk_corners(robot)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Extent(float(robot.foot_radius), low[:2], high[:2], float(-low[2]))


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
    before: GroundHeights,
    feet: np.ndarray,
    extent: Extent,
    config: GroundEventConfig,
    every_label: bool = False,
    appeared: np.ndarray = _NOTHING,
) -> list[Problem]:
    """Returns what speaks against the rest of ``reference``, in which the robot can still stop before it.

    Args:
        reference: what is being followed.
        time: now [s].
        regions: the newest ones.
        ground: the newest map; where it knows nothing, nothing is said.
        before: the map when the reference was planned.
        feet: where the feet are, their centres in W [m], (4, 3).
        extent: of the robot.
        config: what counts.
        every_label: whether footholds may come to lie in regions of any label.
        appeared: points of what has appeared, in W [m], (n, 3); the plan may have been asked for before that was known.
    """
    coming, starts, last = [], [], {}
    for foothold in reference.footholds:
        if foothold.liftoff_time > time:
            coming.append(foothold)
            starts.append(last.get(foothold.leg, feet[foothold.leg]))
        last[foothold.leg] = foothold.position
    lost = lost_footholds(coming, Places(regions, every_label), ground, before, extent.foot_radius, config)
    lost = [words or beside for words, beside in zip(lost, beside_appeared(coming, appeared, config), strict=True)]
    risen = obstacles_on_swings(starts, coming, ground, extent.foot_radius, config)
    problems = []
    for foothold, words, height in zip(coming, lost, risen, strict=True):
        if not words and height is None:
            continue
        place = (int(foothold.leg), round(foothold.touchdown_time, 3))
        lift, target = foothold.liftoff_time, (float(foothold.position[0]), float(foothold.position[1]))
        where = f"{foothold.leg.name} at ({target[0]:.2f}, {target[1]:.2f})"
        if words:
            problems.append(Problem(FOOTHOLD_LOST, (FOOTHOLD_LOST, *place), lift, f"{where}: {words}", target))
        if height is not None:
            words = f"{where}: ground {height:.2f} m higher than the swing"
            problems.append(Problem(SWING_BLOCKED, (SWING_BLOCKED, *place), lift, words, target))
    blocked = obstacle_on_way(reference, time, ground, extent, config)
    if blocked is not None:
        words = f"ground as high as the torso's belly {blocked - time:.1f} s ahead"
        problems.append(Problem(WAY_BLOCKED, (WAY_BLOCKED,), blocked, words))
    return problems


def lost_footholds(
    footholds: list[FootholdTarget],
    places: Places,
    ground: GroundHeights,
    before: GroundHeights,
    radius: float,
    config: GroundEventConfig,
) -> list[str]:
    """Says of each FootholdTarget why a foot of ``radius`` [m] cannot come down as planned; empty where it can."""
    if not footholds:
        return []
    normals = np.array([foothold.normal for foothold in footholds])
    points = np.array([foothold.position for foothold in footholds]) - radius * normals
    disc = _disc(radius, ground.cell)
    heights = _heights_around(ground, points, disc)
    number = np.isfinite(heights).sum(axis=1)
    slopes = normals[:, :1] * disc[:, 0] + normals[:, 1:2] * disc[:, 1]
    above = np.sort(heights - (points[:, 2:] - slopes / normals[:, 2:]), axis=1)  # what is unknown comes last
    middle = np.maximum(np.stack(((number - 1) // 2, number // 2), axis=1), 0)
    changes = np.take_along_axis(above, middle, axis=1).mean(axis=1)  # medians of what is known
    around = _disc(round(radius + _BESIDE, 6), ground.cell)
    risen = _heights_around(ground, points, around) - np.fmax(_heights_around(before, points, around), points[:, 2:])
    touched = (risen > config.height_change).mean(axis=1) > _TOUCHED
    held, verdicts = places.hold(points, config.region_tolerance), []
    for k, foothold in enumerate(footholds):
        words = ""
        if number[k] >= _SEEN * len(disc):
            if abs(changes[k]) > config.height_change:
                words = f"the ground is {abs(changes[k]):.2f} m {'higher' if changes[k] > 0 else 'lower'} than planned"
            elif touched[k]:
                words = f"the ground beside it has risen by {np.nanmax(risen[k]):.2f} m"
            elif places.watch(foothold.region) and not held[k]:
                words = "in no region any more"
        verdicts.append(words)
    return verdicts


def beside_appeared(footholds: list[FootholdTarget], appeared: np.ndarray, config: GroundEventConfig) -> list[str]:
    """Says of each FootholdTarget that it is on or beside ``appeared`` points (n, 3) [m]; empty where it is not.

    No plan that was asked for since they are known puts a foot there; see ``planning/appeared_ground.py``.
    """
    if not len(appeared):
        return [""] * len(footholds)
    least, verdicts = config.keep_off_least - config.region_tolerance, []
    for foothold in footholds:
        away = np.hypot(*(appeared[:, :2] - foothold.position[:2]).T).min()
        verdicts.append(f"something has appeared {away:.2f} m beside it" if away < least else "")
    return verdicts


def obstacles_on_swings(
    starts: list[np.ndarray],
    footholds: list[FootholdTarget],
    ground: GroundHeights,
    radius: float,
    config: GroundEventConfig,
) -> list[float | None]:
    """By how much ground on the way of each swing is higher than all that it was planned to clear [m]; None: it is not."""
    found: list[float | None] = []
    for start, foothold in zip(starts, footholds, strict=True):
        found.append(None)
        if foothold.profile is None or len(foothold.profile) != SAMPLES or not ground.height.size:
            continue
        straight = start[2] + PARTS * (foothold.position[2] - start[2]) + foothold.apex_height
        now = ground_profile(start, foothold.position, (), radius, ground)
        excess = float((now - np.maximum(foothold.profile, straight))[_ENDS:-_ENDS].max())
        if excess > config.height_change:
            found[-1] = excess
    return found


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
    base, rpy = states[:, CentroidalState.POSITION], states[:, CentroidalState.ORIENTATION]
    body, c, s = extent.under_body, np.cos(rpy[:, 2])[:, None], np.sin(rpy[:, 2])[:, None]
    x, y = c * body[:, 0] - s * body[:, 1] + base[:, :1], s * body[:, 0] + c * body[:, 1] + base[:, 1:2]
    heights = ground.at(x.ravel(), y.ravel()).reshape(x.shape)
    # Small angles: the belly is inclined as the base, but its points lie above where they lie on level ground.
    inclined = np.sin(rpy[:, :1]) * np.cos(rpy[:, 1:2]) * body[:, 1] - np.sin(rpy[:, 1:2]) * body[:, 0]
    limit = base[:, 2:] + inclined - extent.belly - config.body_clearance
    blocked = (heights > limit).sum(axis=1) >= _BODY_POINTS
    if blocked[0] or not blocked.any():
        return None
    return float(reference.times[ahead[::step]][np.argmax(blocked)])


def appeared_ground(before: GroundHeights, now: GroundHeights, place: tuple[float, float], rise: float) -> np.ndarray:
    """Points (n, 3) [m] of the map ``now`` around a ``place`` that are more than ``rise`` [m] higher than ``before``."""
    points = now.points_around(np.array(place), _AROUND)
    return points[points[:, 2] - before.at(*points[:, :2].T) > rise]


def _heights_around(ground: GroundHeights, points: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Heights [m] at ``offsets`` (d, 2) from the ``points`` (n, 3), (n, d); NaN where unknown."""
    places = points[:, None, :2] + offsets
    return ground.at(*places.reshape(-1, 2).T).reshape(places.shape[:2])


@cache
def _disc(radius: float, cell: float) -> np.ndarray:
    """Offsets of the middles of cells within ``radius`` [m] of a point, (n, 2)."""
    steps = cell * np.arange(-np.floor(radius / cell), np.floor(radius / cell) + 1)
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    return grid[np.hypot(*grid.T) <= radius]
