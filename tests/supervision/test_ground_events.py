"""What the ground says against a reference, on hand-made values."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.supervision.ground_events import (
    FOOTHOLD_LOST,
    SWING_BLOCKED,
    WAY_BLOCKED,
    Doubts,
    Extent,
    GroundEventConfig,
    Places,
    Problem,
    appeared_ground,
    confirmed_problem,
    extent_of,
    find_problems,
    lost_footholds,
    obstacle_on_way,
    obstacles_on_swings,
)
from quadpips_drake.trajectory.swing.ground_profile import SAMPLES
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, PlanarRegion, RegionSet
from quadpips_drake.values.steppability import Steppability
from tests.supervision import ground_reference

CONFIG = GroundEventConfig()
RADIUS = 0.03
EXTENT = Extent(RADIUS, np.array([-0.3, -0.1]), np.array([0.3, 0.1]), 0.1)
UP = np.array([0.0, 0.0, 1.0])
FEET = np.array([[0.35, 0.2, RADIUS], [0.35, -0.2, RADIUS], [-0.35, 0.2, RADIUS], [-0.35, -0.2, RADIUS]])
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def region(x=0.0, y=0.0, half=2.0, label=Steppability.STEPPABLE, id=7, z=0.0) -> PlanarRegion:
    X_WR = np.eye(4)
    X_WR[:3, 3] = x, y, z
    return PlanarRegion(id, X_WR, half * SQUARE, half * SQUARE, label)


FLOOR = RegionSet(1.0, (region(),))


def ground(*raised) -> GroundHeights:
    """A flat map of 4 x 4 m about the origin; ``raised``: x, y, half the side and height of squares on it [m]."""
    middles = -2.0 + 0.01 * (np.arange(400) + 0.5)
    heights = np.zeros((400, 400), np.float32)
    for x, y, half, height in raised:
        heights[np.ix_(abs(middles - x) < half, abs(middles - y) < half)] = height
    return GroundHeights(1.0, np.array([-2.0, -2.0]), 0.01, heights)


def walk(**changes) -> WholeBodyReference:
    """LF swings from 1.0 to 1.4 s to (0.65, 0.2), RF from 1.5 to 1.9 s to (0.65, -0.2); the base goes 0.5 m in 2 s."""
    profile = np.full(SAMPLES, RADIUS)
    footholds = tuple(
        FootholdTarget(leg, begin, begin + 0.4, np.array([0.65, y, RADIUS]), UP, region(), profile, 0.08)
        for leg, begin, y in ((Leg.LF, 1.0, 0.2), (Leg.RF, 1.5, -0.2))
    )
    times = np.arange(0.0, 2.001, 0.02)
    states = np.zeros((len(times), 24))
    states[:, CentroidalState.POSITION] = np.linspace([0, 0, 0.55], [0.5, 0, 0.55], len(times))
    footholds = tuple(replace(foothold, **changes) for foothold in footholds)
    return WholeBodyReference(0.0, 1, times, states, 0.0 * states, ContactSchedule.standing(), footholds)


def found(heights, regions=FLOOR, time=0.5, reference=None, before=None) -> list[tuple]:
    problems = find_problems(reference or walk(), time, regions, heights, before or ground(), FEET, EXTENT, CONFIG)
    return [(problem.kind, problem.key[1:2]) for problem in problems]


def test_known_and_unknown_ground_that_is_as_planned_says_nothing():
    assert found(ground()) == []
    assert found(GroundHeights.empty()) == [] and found(GroundHeights.empty(), RegionSet.empty()) == []
    assert found(ground((0.65, 0.2, 0.1, np.nan)), RegionSet.empty(), time=1.2) == [(FOOTHOLD_LOST, (int(Leg.RF),))]
    assert found(ground((0.65, 0.2, 0.1, 0.02))) == [], "two centimetres are noise"


@pytest.mark.parametrize("height", [0.05, -0.05, 0.15])
def test_a_foothold_is_lost_when_the_ground_is_higher_or_lower(height):
    assert (FOOTHOLD_LOST, (int(Leg.LF),)) in found(ground((0.65, 0.2, 0.1, height)))
    assert (FOOTHOLD_LOST, (int(Leg.LF),)) not in found(ground((0.65, 0.2, 0.1, height)), time=1.1), "it has lifted off"


def test_a_foothold_is_lost_when_something_has_risen_beside_it():
    beside = ground((0.78, 0.2, 0.1, 0.15))  # its edge 3 cm from the foot's middle
    assert (FOOTHOLD_LOST, (int(Leg.LF),)) in found(beside)
    assert (FOOTHOLD_LOST, (int(Leg.LF),)) not in found(beside, before=beside), "a step that was planned for"
    assert (FOOTHOLD_LOST, (int(Leg.LF),)) not in found(ground((0.82, 0.2, 0.1, 0.15)))


def test_a_foothold_is_lost_when_it_is_in_no_region_that_may_carry_a_foot():
    lost = [(FOOTHOLD_LOST, (int(Leg.LF),)), (FOOTHOLD_LOST, (int(Leg.RF),))]
    assert found(ground(), RegionSet(1.0, (region(x=-2.0),))) == lost
    assert found(ground(), RegionSet(1.0, (region(label=Steppability.PASSABLE),))) == lost
    assert found(ground(), RegionSet(1.0, (region(0.65, 0.2, 0.1), region(-1.0, 0.0, 0.5)))) == lost[1:]
    assert found(ground(), RegionSet(1.0, (region(0.65 + 0.12, 0.0, 0.1), region(0.65, 0.0, 0.18)))) == [], "2 cm beside it"
    never_seen = walk(region=region(id=-1))
    assert found(ground(), RegionSet.empty(), reference=never_seen) == [], "nor was it when it was planned"


def test_a_foothold_is_not_lost_by_a_label_that_does_not_count():
    passable = region(label=Steppability.PASSABLE)
    ignored = find_problems(walk(), 0.5, RegionSet(1.0, (passable,)), ground(), ground(), FEET, EXTENT, CONFIG, True)
    assert ignored == []
    void = find_problems(walk(), 0.5, RegionSet.empty(), ground(), ground(), FEET, EXTENT, CONFIG, True)
    assert len(void) == 2, "but without a region it is lost"
    assert found(ground(), RegionSet(1.0, (passable,)), reference=walk(region=passable)) == [], "chosen in spite of it"


def test_a_foothold_is_lost_beside_what_had_appeared_when_its_plan_was_asked_for():
    """The box is in the map before and now: the plan took it for a step, since nobody had told it what had appeared."""
    box = ground((0.65, 0.2, 0.1, 0.15))
    on_it = replace(walk().footholds[0], position=np.array([0.65, 0.2, 0.15 + RADIUS]), profile=None)
    stepping = replace(walk(), footholds=(on_it,))
    regions = RegionSet(1.0, (region(), region(0.65, 0.2, 0.1, z=0.15)))
    arguments = stepping, 0.5, regions, box, box, FEET, EXTENT, CONFIG, True
    assert find_problems(*arguments) == []
    top = np.array([[0.6, 0.15, 0.15], [0.7, 0.25, 0.15]])
    (problem,) = find_problems(*arguments, top)
    assert (problem.kind, problem.place) == (FOOTHOLD_LOST, (0.65, 0.2))
    aside = np.array([0.65 + CONFIG.keep_off_least, 0.2, 0.15])[None]
    assert find_problems(*arguments, aside) == [], "as near as a plan may come"


def test_a_swing_is_blocked_by_ground_above_what_it_was_planned_to_clear():
    assert found(ground((0.5, -0.2, 0.05, 0.2))) == [(SWING_BLOCKED, (int(Leg.RF),))]
    assert found(ground((0.5, -0.2, 0.05, 0.09))) == [], "it swings higher than that"
    knew = walk(profile=np.where(abs(np.linspace(0, 1, SAMPLES) - 0.5) < 0.4, 0.2 + RADIUS, RADIUS))
    assert found(ground((0.5, -0.2, 0.05, 0.2)), reference=knew) == []


def test_the_way_of_the_torso_is_blocked_by_ground_up_to_its_belly():
    assert found(ground((0.6, 0.0, 0.1, 0.5))) == [(WAY_BLOCKED, ())]
    problem = find_problems(walk(), 0.5, FLOOR, ground((0.6, 0.0, 0.1, 0.5)), ground(), FEET, EXTENT, CONFIG)[0]
    assert 0.5 < problem.before < 1.2, "before the fore edge of the torso, 0.3 m ahead of its middle, is there"
    assert found(ground((0.6, 0.0, 0.1, 0.3))) == [], "it passes below"
    assert found(ground((0.2, 0.0, 0.1, 0.5))) == [], "the torso is there already"


def test_a_belly_that_is_inclined_as_the_ground_passes_over_it():
    """A ramp of 0.5 rad whose end under the torso's fore edge is 0.25 m high, 3 cm higher than a level belly."""
    flat, reference = ground(), walk()
    rising = np.tan(0.5) * np.maximum(0.0, -2.0 + flat.cell * (np.arange(400) + 0.5) - 0.35)
    ramp = replace(flat, height=np.tile(rising[:, None], (1, 400)).astype(np.float32))
    states = reference.states - np.eye(24)[CentroidalState.POSITION][2] * 0.2
    assert obstacle_on_way(replace(reference, states=states), 0.5, ramp, EXTENT, CONFIG) is not None
    states[:, CentroidalState.ORIENTATION][:, 1] = -0.5
    assert obstacle_on_way(replace(reference, states=states), 0.5, ramp, EXTENT, CONFIG) is None


def test_the_extent_of_robots_is_that_of_their_whole_torso():
    for name, belly, fore in (("anymal_c", 0.1, 0.47), ("go2", 0.08, 0.31)):
        extent = extent_of(load_robot(name))
        assert 0.5 * belly < extent.belly < 2.0 * belly
        assert abs(extent.fore_left[0] - fore) < 0.03 and extent.hind_right[0] < -0.15, "its nose, not its hips"
        assert extent.hind_right[1] == pytest.approx(-extent.fore_left[1])


def test_a_problem_is_certain_after_three_region_sets_in_a_row():
    first, second = Problem(FOOTHOLD_LOST, (FOOTHOLD_LOST, 0, 1.4), 1.0, ""), Problem(WAY_BLOCKED, (WAY_BLOCKED,), 0.8, "")
    doubts, certain = Doubts(), []
    for stamp, problems in enumerate([[first], [first, second], [second], [first, second], [first], [first]]):
        doubts, problem = confirmed_problem(doubts, problems, float(stamp), CONFIG)
        certain.append(problem)
        again, nothing = confirmed_problem(doubts, problems, float(stamp), CONFIG)
        assert again is doubts and nothing is None, "the same set does not count twice"
    assert certain == [None, None, None, second, None, first]
    both = confirmed_problem(Doubts(0.0, ((first.key, 2), (second.key, 2))), [first, second], 1.0, CONFIG)[1]
    assert both is second, "the more urgent one"


def test_what_has_risen_around_a_place_is_what_appeared():
    before = ground((-1.0, -1.0, 0.3, 0.2), (0.9, 0.2, 0.05, np.nan))
    now = ground(
        (-1.0, -1.0, 0.3, 0.2),
        (0.65, 0.2, 0.1, 0.15),
        (0.65, -0.1, 0.02, 0.02),
        (0.9, 0.2, 0.05, 0.3),
        (-1.0, 1.0, 0.1, 0.4),
    )
    points = appeared_ground(before, now, (0.6, 0.2), 0.03)
    assert len(points) == 400 and (points[:, 2] == np.float32(0.15)).all()
    assert (np.abs(points[:, :2] - [0.65, 0.2]) < 0.1).all()
    assert len(appeared_ground(GroundHeights.empty(), now, (0.6, 0.2), 0.03)) == 0
    assert len(appeared_ground(now, before, (0.6, 0.2), 0.03)) == 0


@pytest.mark.parametrize("seed", range(6))
def test_all_footholds_at_once_are_judged_as_one_by_one(seed):
    random = np.random.default_rng(seed)
    tilt = random.uniform(-0.2, 0.2, (12, 2))
    normals = np.column_stack((tilt, np.ones(12))) / np.sqrt(1.0 + (tilt**2).sum(axis=1))[:, None]
    xy = random.uniform(-1.2, 1.2, (12, 2))
    regions = RegionSet(1.0, tuple(region(*place, 0.3, id=k) for k, place in enumerate(xy[:8] + 0.1)))
    heights = [0.02, 0.05, 0.3, np.nan, -0.05, 0.5]
    squares = [(*random.uniform(-0.8, 0.8, 2), random.uniform(0.2, 0.4), height) for height in random.permutation(heights)]
    now, before = ground(*squares), ground(*squares[:2])
    footholds = [
        replace(
            walk().footholds[0],
            position=np.array([x, y, RADIUS]),
            normal=normal,
            region=region(id=int(k > 3)),
            apex_height=0.0,
        )
        for k, (x, y, normal) in enumerate(zip(*xy.T, normals, strict=True))
    ]
    starts = [np.array([*random.uniform(-1.2, 1.2, 2), RADIUS]) for _ in footholds]
    lost = lost_footholds(footholds, Places(regions), now, before, RADIUS, CONFIG)
    assert lost == [ground_reference.foothold_problem(f, regions, now, before, RADIUS, CONFIG) for f in footholds]
    risen = obstacles_on_swings(starts, footholds, now, RADIUS, CONFIG)
    pairs = zip(starts, footholds, strict=True)
    assert risen == [ground_reference.obstacle_on_swing(start, f, now, RADIUS, CONFIG) for start, f in pairs]
    assert any(lost) and not all(lost) and set(risen) != {None}, "both are there"
    shift = np.zeros(24)
    shift[CentroidalState.POSITION] = *random.uniform(-0.3, 0.3, 2), -0.2
    shift[CentroidalState.YAW] = seed
    arguments = replace(walk(), states=walk().states + shift), 0.5, now, EXTENT, CONFIG
    assert obstacle_on_way(*arguments) == ground_reference.obstacle_on_way(*arguments)
