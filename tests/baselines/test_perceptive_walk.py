"""The walk by velocity on regions: dead zone, filter, freezing, no region, where the base goes, what the MPC is told."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from quadpips_drake.baselines.perceptive_config import PerceptiveReferenceConfig
from quadpips_drake.baselines.perceptive_walk import PerceptiveMemory, PerceptiveWalk
from quadpips_drake.control.mpc.mpc_swings import foothold_halfspaces
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.math.polygons import distance_inside
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.regions import GroundHeights, RegionSet
from tests.baselines.hand_made import floor, region

AHEAD = np.array([0.25, 0.0, 0.0])


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def walked(robot, regions, until=1.0, config=None, *, move=lambda t: np.zeros(3), command=AHEAD, heights=None):
    """The memories of a trot on the spot, plus ``move(t)``, until a time [s]; ``regions``: a set, or a function of time."""
    walk, memory = PerceptiveWalk(robot, config), PerceptiveMemory.empty()
    memories, standing = [], standing_state(robot)
    for t in np.arange(0.0, until, 0.02):
        state = replace(standing, stamp=float(t), p_WB=standing.p_WB + move(t))
        known = regions(t) if callable(regions) else regions
        memory = walk.update(memory, state, command, load_gait("trot"), known, heights)
        memories.append(memory)
    return memories


def word(memory, leg, touchdown):
    """The target of a swing in a memory, or None."""
    same = [f for f in memory.reference.footholds if f.leg == leg and abs(f.touchdown_time - touchdown) < 1e-3]
    return same[0] if same else None


def test_footholds_lie_in_insets_and_the_mpc_gets_their_polygons(robot):
    places = [(0.25 * (i - 4), 0.25 * (j - 4), 0.02 * ((i + j) % 3)) for i in range(9) for j in range(9)]
    stones = [region(k, place, (0.2, 0.2)) for k, place in enumerate(places)]
    reference = walked(robot, RegionSet(0.0, tuple(stones)), 0.5)[-1].reference
    assert len(reference.footholds) >= 8
    for target in reference.footholds:
        local = target.region.X_WR[:3, :3].T @ (target.position - target.region.center)
        assert distance_inside(np.array(target.region.inset), *local[:2]) >= -1e-9
        assert local[2] == pytest.approx(robot.foot_radius)
        assert len(target.polygon) == 16
        assert min(distance_inside(np.array(target.region.boundary), *corner) for corner in target.polygon) >= -1e-9
    times = np.linspace(reference.stamp, reference.stamp + 1.0, 23)
    normals, offsets = foothold_halfspaces(reference.footholds, times)
    assert normals.shape[2] == 16
    last = [f for f in reference.footholds if f.touchdown_time < times[-1]][-1]
    corners = last.region.center + last.polygon @ last.region.X_WR[:3, :2].T
    margins = corners @ normals[-1, last.leg].T + offsets[-1, last.leg]
    assert margins.min() >= -1e-9  # the polygon's corners and nothing beyond them
    beyond = last.position + 1.2 * (corners - last.position)
    assert (beyond @ normals[-1, last.leg].T + offsets[-1, last.leg]).min(axis=1).max() < 0.0


def test_a_small_change_of_mind_moves_no_foothold_and_a_large_one_most_of_the_way(robot):
    # The robot jumps sideways at 0.4 s; its measured velocity stays zero.
    for jump, part in ((0.04, 0.0), (0.12, 1.0 - 0.333)):
        move = partial(lambda jump, t: np.array([0.0, jump * (t > 0.39), 0.0]), jump)
        before, after = walked(robot, floor(), 0.41, move=move, command=np.zeros(3))[-2:]
        swing = max(before.reference.footholds, key=lambda f: f.touchdown_time)
        moved = word(after, swing.leg, swing.touchdown_time).position - swing.position
        np.testing.assert_allclose(moved, [0.0, part * jump, 0.0], atol=1e-9)


def test_a_foothold_is_frozen_before_touch_down(robot):
    config = PerceptiveReferenceConfig(dead_zone=0.0)
    memories = walked(robot, floor(), 1.6, config, move=lambda t: np.array([0.0, 0.05 * np.sin(9.0 * t), 0.0]))
    words: dict = {}
    for memory in memories:
        for target in memory.reference.footholds:
            key = int(target.leg), round(target.touchdown_time, 3)
            words.setdefault(key, []).append((target.touchdown_time - memory.reference.stamp, target.position))
    landed = [history for history in words.values() if history[-1][0] <= 0.0 and history[0][0] > 0.5]
    assert len(landed) >= 4
    for history in landed:
        late = np.array([p for left, p in history if left <= 0.25 + 1e-9])
        early = np.array([p for left, p in history if left > 0.25 + 1e-9])
        assert np.ptp(late[1:], axis=0).max() == 0.0
        assert np.ptp(early, axis=0).max() > 0.005


def test_frozen_footholds_stay_when_their_region_is_gone(robot):
    memories = walked(robot, lambda t: floor() if t < 0.45 else RegionSet(t), 0.6)
    touchdown = min(f.touchdown_time for f in memories[-1].reference.footholds)
    swings = [f for f in memories[-1].reference.footholds if f.touchdown_time == touchdown]
    assert len(swings) == 2 and touchdown - 0.45 < 0.25
    for swing in swings:
        assert swing.region is not None
    assert any(f.region is None for f in memories[-1].reference.footholds)


def test_without_a_region_feet_stay_and_are_counted_once(robot):
    memories = walked(robot, RegionSet(0.0), 2.0)
    feet = robot.foot_positions_W(standing_state(robot))
    for target in memories[-1].reference.footholds:
        assert target.region is None and target.polygon is None
        np.testing.assert_allclose(target.position, feet[target.leg], atol=0.02)
    touchdowns = {(f.leg, round(f.touchdown_time, 3)) for m in memories for f in m.reference.footholds}
    frozen = sum(time - 0.25 <= memories[-1].reference.stamp for _, time in touchdowns)
    assert memories[-1].fallbacks == frozen > 6
    assert walked(robot, floor(), 1.0)[-1].fallbacks == 0


def test_the_base_rises_with_the_regions_ahead(robot):
    rise = 0.15
    steps = RegionSet(0.0, (region(0, (-2.6, 0.0, 0.0), (6.0, 4.0)), region(1, (3.4, 0.0, rise), (6.0, 4.0))))
    reference = walked(robot, steps, 0.9, PerceptiveReferenceConfig(horizon=6.0))[-1].reference
    z, pitch = reference.states[:, CentroidalState.POSITION][:, 2], reference.states[:, CentroidalState.ORIENTATION][:, 1]
    level = robot.nominal_base_height
    assert z[0] == pytest.approx(level, abs=0.01) and z.max() > level + 0.5 * rise
    assert pitch.min() < -0.08  # nose up while only the fore feet are on the step
    assert np.abs(np.diff(z)).max() < 0.03 and np.abs(np.diff(pitch)).max() < 0.1


def test_swings_clear_the_heights_if_they_are_to(robot):
    """A wall of 0.30 m across the way of the fore feet: it counts as 0.16 m high, and only if swings are to clear it."""
    feet = robot.nominal_footholds_B
    cells = np.zeros((300, 300), np.float32)
    wall = int(100 * (feet[0, 0] + 0.05 + 1.5))
    cells[wall : wall + 2] = 0.30
    heights = GroundHeights(0.0, np.array([-1.5, -1.5]), 0.01, cells)
    blind = walked(robot, floor(), 1.0, heights=heights)[-1].reference
    assert all(f.profile is None for f in blind.footholds)
    config = PerceptiveReferenceConfig(clear_ground=True)
    seen = walked(robot, floor(), 1.0, config, heights=heights)[-1].reference
    rises = [max(f.profile.max() for f in seen.footholds if f.leg == leg) - robot.foot_radius for leg in range(4)]
    np.testing.assert_allclose(rises, [0.16, 0.16, 0.0, 0.0], atol=0.02)


def test_the_same_walk_twice_is_the_same(robot):
    first, again = (walked(robot, floor(), 0.6, move=lambda t: np.array([0.1 * t, 0.0, 0.0]))[-1] for _ in range(2))
    assert np.array_equal(first.reference.states, again.reference.states)
    for one, other in zip(first.reference.footholds, again.reference.footholds, strict=True):
        assert np.array_equal(one.position, other.position) and np.array_equal(one.polygon, other.polygon)


def test_a_walk_that_begins_anew_keeps_its_count(robot):
    memory = walked(robot, RegionSet(0.0), 2.0)[-1]
    fresh = memory.restarted()
    assert fresh.fallbacks == memory.fallbacks and not fresh.wishes and len(fresh.reference.times) == 0
