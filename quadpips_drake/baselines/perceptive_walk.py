"""A walk by velocity command whose feet come down on planar regions: heuristic footholds, adjusted to what is seen."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.grown_polygon import grown_polygon
from quadpips_drake.baselines.learned_footholds.advice import FootholdAdvice
from quadpips_drake.baselines.perceptive_config import PerceptiveReferenceConfig
from quadpips_drake.baselines.region_projection import bases_over_regions, best_foothold, leg_penalty
from quadpips_drake.control.references.velocity_reference import VelocityWalk, WalkMemory, advance
from quadpips_drake.gaits.gaits import Gait
from quadpips_drake.math.interpolation import interpolated
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.planning.region_table import RegionTable, make_region_table, may_carry_a_foot, outline_table
from quadpips_drake.trajectory.swing.ground_profile import PARTS, KnownGround
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import PlanSketch
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.robot_state import RobotState

_SAME_TIME = 1e-4
"""Touch-downs closer than this are the same [s]."""


@dataclass(frozen=True, eq=False)
class SteppableGround(ImmutableValue):
    """The regions of one set that may carry a foot, ready to be asked."""

    source: RegionSet
    regions: tuple
    """PlanarRegions."""
    table: RegionTable
    """The same, packed."""

    @cached_property
    def outlines(self) -> RegionTable:
        """The same with their boundaries."""
        return outline_table(self.regions)

    @staticmethod
    def of(source: RegionSet, max_slope: float) -> "SteppableGround":
        """Those of ``source`` that are no steeper than ``max_slope`` [rad]."""
        regions = tuple(region for region in source.regions if may_carry_a_foot(region, max_slope))
        return SteppableGround(source, regions, make_region_table(regions))


@dataclass(frozen=True, eq=False)
class PerceptiveMemory(ImmutableValue):
    """What the walk remembers from one update to the next."""

    walk: WalkMemory
    """Of the walk by velocity, which knows nothing of regions."""
    reference: WholeBodyReference
    """Result of the update."""
    ground: SteppableGround
    """What the feet can come down on."""
    wishes: tuple = ()
    """(leg, touch-down [s], ground point in W (3,)) of each foothold, as it was wanted before it was projected."""
    sketch: PlanSketch = None
    """What there is to draw."""
    fallbacks: int = 0
    """How many feet have been sent back to where they were because there was no region near."""
    looked: float = -np.inf
    """When the regions were looked at last [s]."""

    @staticmethod
    def empty() -> "PerceptiveMemory":
        """Before the first update."""
        walk, ground = WalkMemory.empty(), SteppableGround.of(RegionSet.empty(), 0.0)
        return PerceptiveMemory(walk, walk.reference, ground, sketch=PlanSketch.empty())

    def restarted(self) -> "PerceptiveMemory":
        """The memory of a walk that begins anew on ground that is known."""
        fresh = PerceptiveMemory.empty()
        return replace(fresh, ground=self.ground, sketch=self.sketch, fallbacks=self.fallbacks, looked=self.looked)


class PerceptiveWalk:
    """Rolling reference over regions: Raibert's footholds, each projected onto the best region (see ``region_projection``).

    A wish for a foothold moves only if it moves far, and then not all the way; shortly before touch-down it is frozen.
    With ``config.learned`` a network moves each wish before it is projected (see ``learned_footholds``).
    Within its region the MPC may move the foot as far as a polygon grown around the foothold reaches. The base keeps its
    height over the regions under its nominal feet, and their inclination.
    """

    def __init__(self, robot, config: PerceptiveReferenceConfig | None = None):
        self._robot = robot
        self._config = config or PerceptiveReferenceConfig()
        self._walk = VelocityWalk(robot, self._config)
        self._legs = leg_penalty(robot, self._config.max_extension, self._config.penalty_weight)
        self._nominal = np.array(robot.nominal_footholds_B[:, :2])
        self._advice = None
        if self._config.learned:
            model = Path(self._config.learned_model) if self._config.learned_model else None
            self._advice = FootholdAdvice(robot, model, self._config.max_offset)

    def update(
        self,
        memory: PerceptiveMemory,
        state: RobotState,
        command: np.ndarray,
        gait: Gait,
        regions: RegionSet,
        heights: GroundHeights | None = None,
    ) -> PerceptiveMemory:
        """Next memory, with the reference from ``state.stamp`` on.

        Args:
            memory: result of the last update.
            state: measured state.
            command: forward, left [m/s], yaw rate [rad/s] in the robot's heading frame, (3,).
            gait: in which to walk; a gait without swings: to stop, and stand.
            regions: what is known of the ground.
            heights: of the ground, for swings; None: unknown.
        """
        walk = self._walk.update(memory.walk, state, command, gait)
        ground = memory.ground
        if ground.source is not regions:
            ground = SteppableGround.of(regions, self._config.max_slope)
        reference = self._over_regions(walk, ground)
        wishes = self._wishes(walk.reference.footholds, memory.wishes)
        footholds = self._footholds(walk, reference, state, wishes, memory, ground, heights)
        sketch = memory.sketch
        if _swings(footholds) != _swings(memory.reference.footholds):
            sketch = _sketch(state.stamp, sketch.id + 1, footholds, self._robot.foot_radius)
        reference = replace(reference, footholds=footholds)
        fallbacks = memory.fallbacks + self._newly_without_region(footholds, memory.walk.stamp, state.stamp)
        return PerceptiveMemory(walk, reference, ground, wishes, sketch, fallbacks, memory.looked)

    def _over_regions(self, walk: WalkMemory, ground: SteppableGround) -> WholeBodyReference:
        """The reference with the base at its height over the regions below, and inclined as they are."""
        c, blind = self._config, walk.reference
        around = round(0.5 * c.smoothing_time / c.sample_time)
        times = c.sample_time * np.arange(-around, len(blind.times) + around)
        poses = advance(walk.pose, walk.velocity, times)
        plane = np.array([*walk.ground.origin, walk.ground.height, *walk.ground.slope])
        height = self._robot.nominal_base_height
        bases = bases_over_regions(
            ground.table, poses, self._nominal, plane, self._legs, c.search_radius, height, c.max_tilt
        )
        window = np.full(2 * around + 1, 1.0 / (2 * around + 1))
        smooth = np.column_stack([np.convolve(column, window, mode="valid") for column in bases.T])
        states = np.array(blind.states)
        states[:, CentroidalState.POSITION][:, 2] = smooth[:, 0]
        states[:, CentroidalState.ORIENTATION][:, :2] = c.slope_following * smooth[:, 1:]
        states[:, CentroidalState.LINEAR][:, 2] = np.gradient(smooth[:, 0], c.sample_time)
        return replace(blind, states=states)

    def _wishes(self, blind: tuple, before: tuple) -> tuple:
        """Where the feet want to come down: as the walk by velocity has it, with a dead zone and a filter."""
        c, found = self._config, []
        for target in blind:
            wish = target.position - self._robot.foot_radius * target.normal
            last = next((p for leg, time, p in before if leg == target.leg and _same(time, target.touchdown_time)), None)
            if last is not None:
                way = wish - last
                wish = last if np.sqrt(way @ way) < c.dead_zone else c.filter_part * last + (1.0 - c.filter_part) * wish
            found.append((target.leg, target.touchdown_time, wish))
        return tuple(found)

    def _footholds(self, walk, reference, state, wishes, memory, ground: SteppableGround, heights) -> tuple:
        """The FootholdTargets on the regions; frozen ones stay as they were."""
        c, now = self._config, state.stamp
        ahead = walk.reference.footholds
        bases = self._bases(walk, reference, state)
        known = KnownGround(ground.regions, heights) if c.clear_ground else None
        feet, soles = walk.touched + self._robot.foot_radius * walk.ground.normal, walk.touched.copy()
        targets, together = [], ()
        for blind, (_, _, wish) in zip(ahead, wishes, strict=True):
            if blind.leg not in together or not _same(blind.touchdown_time, targets[-1].touchdown_time):
                together = tuple(other.leg for other in ahead if _same(other.touchdown_time, blind.touchdown_time))
                before = soles.copy()
            target = _matching(memory.reference.footholds, blind)
            if target is None or now < blind.touchdown_time - c.freeze_time:
                if self._advice is not None:
                    wish = self._advice.moved(wish, blind.leg, together, before, ground.outlines)
                target = self._foothold(blind, wish, bases, ground, walk)
                if known is not None:
                    start = feet[blind.leg]
                    target = replace(target, profile=self._profile(known, start, target.position))
            feet[blind.leg] = target.position
            soles[blind.leg] = target.position - self._robot.foot_radius * target.normal
            targets.append(target)
        return tuple(targets)

    def _bases(self, walk: WalkMemory, reference: WholeBodyReference, state: RobotState):
        """(times, states) of the base to which the footholds belong: the reference, moved to where the robot is."""
        states = np.array(reference.states)
        moved = self._config.foothold_anchor * (state.p_WB[:2] - walk.pose[:2])
        states[:, CentroidalState.POSITION][:, :2] += moved
        return reference.times, states, reference.schedule

    def _foothold(self, blind: FootholdTarget, wish, bases, ground: SteppableGround, walk: WalkMemory) -> FootholdTarget:
        """The best foothold near ``wish``; where there is none, the foot stays where it touched the ground last."""
        c, radius = self._config, self._robot.foot_radius
        times, states, schedule = bases
        lifts = (start for start, _ in schedule.swings(blind.leg) if start >= blind.touchdown_time)
        stay = np.array([blind.touchdown_time, next(lifts, blind.touchdown_time)])
        poses = interpolated(stay, times, states)
        origins = np.ascontiguousarray(poses[:, CentroidalState.POSITION])
        rotations = np.array([rotation_from_rpy(np.array(rpy)) for rpy in poses[:, CentroidalState.ORIENTATION]])
        k, *point = best_foothold(
            ground.table, int(blind.leg), np.array(wish), origins, rotations, self._legs, c.search_radius
        )
        if k < 0:
            normal = walk.ground.normal
            return replace(blind, position=walk.touched[blind.leg] + radius * normal, normal=normal)
        region = ground.regions[k]
        u, v = ((point - region.center) @ region.X_WR[:3, :2]).tolist()
        polygon = grown_polygon(np.array(region.boundary, float), u, v, c.polygon_vertices, c.polygon_growth)
        return replace(
            blind,
            position=np.array(point) + radius * region.normal,
            normal=np.array(region.normal),
            region=region,
            polygon=polygon if len(polygon) else None,
        )

    def _profile(self, known: KnownGround, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Heights that a swing has to clear, none higher than the apex may rise."""
        profile = known.profile(start, end, self._robot.foot_radius)
        return np.minimum(profile, start[2] + PARTS * (end[2] - start[2]) + self._config.max_apex_height)

    def _newly_without_region(self, footholds: tuple, before: float, now: float) -> int:
        """How many feet without a region have been frozen since the time ``before`` [s]."""
        frozen = (t.touchdown_time - self._config.freeze_time for t in footholds if t.region is None)
        return sum(before < time <= now for time in frozen)


def _same(time: float, other: float) -> bool:
    return abs(time - other) < _SAME_TIME


def _matching(footholds: tuple, blind: FootholdTarget) -> FootholdTarget | None:
    """The target among ``footholds`` of the same swing as ``blind``."""
    same = (t for t in footholds if t.leg == blind.leg and _same(t.touchdown_time, blind.touchdown_time))
    return next(same, None)


def _swings(footholds: tuple) -> tuple:
    return tuple((target.leg, round(target.touchdown_time / _SAME_TIME)) for target in footholds)


def _sketch(stamp: float, number: int, footholds: tuple, foot_radius: float) -> PlanSketch:
    """What there is to draw of ``footholds``."""
    points = [target.position - foot_radius * target.normal for target in footholds]
    return PlanSketch(
        stamp=stamp,
        id=number,
        points=np.array(points).reshape(-1, 3),
        normals=np.array([target.normal for target in footholds]).reshape(-1, 3),
        legs=np.array([int(Leg(target.leg)) for target in footholds], dtype=int),
    )
