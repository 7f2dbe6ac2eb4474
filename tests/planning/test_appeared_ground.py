"""Where no foot stands because something has appeared."""

import numpy as np
import pytest
import shapely

from quadpips_drake.planning.appeared_ground import lead_over, outlines, with_hidden_side, with_margin, without_appeared
from quadpips_drake.terrain.terrain import pose
from quadpips_drake.values.regions import GroundHeights, PlanarRegion, RegionSet

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def region(x, y, z=0.0, half=0.1, tilt=0.0) -> PlanarRegion:
    return PlanarRegion(1, pose((x, y, z), (0.0, tilt, 0.0)), half * SQUARE, 0.9 * half * SQUARE)


def box(x, y, height, half=0.1) -> np.ndarray:
    """Points on top of a box that has appeared."""
    offsets = np.arange(-half + 0.005, half, 0.01)
    grid = np.stack(np.meshgrid(x + offsets, y + offsets), axis=-1).reshape(-1, 2)
    return np.column_stack((grid, np.full(len(grid), height)))


def inset_W(found) -> np.ndarray:
    return found.X_WR[:2, 3] + found.inset @ found.X_WR[:2, :2].T


def test_nobody_stands_on_it():
    top, floor = region(1.0, 0.0, 0.15), region(1.5, 0.0)
    found = without_appeared(RegionSet(3.0, (top, floor)), box(1.0, 0.0, 0.15), 0.14)
    assert found.stamp == 3.0 and found.regions == (floor,)
    assert without_appeared(RegionSet(3.0, (top, floor)), np.zeros((0, 3)), 0.14).regions == (top, floor)
    assert without_appeared(RegionSet(3.0, (top, floor)), box(1.0, 0.0, 0.15)[:5], 0.14).regions == (top, floor), "noise"


@pytest.mark.parametrize(("x", "y"), [(1.3, 0.0), (1.0, -0.3), (0.75, 0.25)])
def test_feet_keep_a_distance(x, y):
    before = region(x, y, half=0.18)
    (after,) = without_appeared(RegionSet(3.0, (before,)), box(1.0, 0.0, 0.15), 0.14).regions
    away = np.maximum(np.abs(inset_W(after) - [1.0, 0.0]) - 0.1, 0.0)
    assert (np.hypot(*away.T) > 0.13).all()
    polygon = shapely.Polygon(after.inset)
    assert polygon.is_valid and polygon.exterior.is_ccw and polygon.convex_hull.area == pytest.approx(polygon.area)
    assert 0.2 * 0.324**2 < polygon.area < 0.324**2
    np.testing.assert_array_equal(after.boundary, before.boundary)


def test_a_large_floor_goes_on_beside_it_and_a_small_patch_under_it_is_gone():
    floor, patch = region(0.0, 0.0, half=2.0), region(1.0, 0.0, half=0.05)
    (after,) = without_appeared(RegionSet(3.0, (floor, patch)), box(1.0, 0.0, 0.15), 0.14).regions
    assert shapely.Polygon(after.inset).area > 0.6 * 3.6**2 and inset_W(after)[:, 0].max() < 0.82


def test_on_a_slope_the_distance_is_one_in_the_horizontal():
    ground = region(1.0, 0.0, half=0.5, tilt=-0.5)
    (after,) = without_appeared(RegionSet(3.0, (ground,)), box(1.3, 0.0, 0.6), 0.14).regions
    xyz = after.X_WR[:3, 3] + np.column_stack((after.inset, np.zeros(len(after.inset)))) @ after.X_WR[:3, :3].T
    assert xyz[:, 0].max() == pytest.approx(1.06, abs=0.015)


def test_two_things_are_two():
    floor = region(0.0, 0.0, half=1.0)
    points = np.concatenate((box(0.9, 0.0, 0.15, 0.05), box(-0.9, 0.0, 0.15, 0.05)))
    (after,) = without_appeared(RegionSet(3.0, (floor,)), points, 0.14).regions
    assert np.abs(inset_W(after)[:, 0]).max() == pytest.approx(0.71, abs=0.02)


def test_swings_clear_it_with_a_margin():
    heights = np.zeros((200, 200), np.float32)
    heights[:, 150:] = np.nan
    known = GroundHeights(1.0, np.array([0.0, -1.0]), 0.01, heights)
    found = with_margin(known, box(1.0, 0.0, 0.15))
    assert found.height.dtype == np.float32 and (found.stamp, found.cell) == (1.0, 0.01)
    np.testing.assert_allclose(found.at([1.0, 1.095, 1.135, 1.145], [0.0] * 4), [0.175, 0.175, 0.175, 0.0], atol=1e-6)
    assert np.isnan(found.at([1.0], [0.7])), "what is unknown stays so"
    assert with_margin(known, np.zeros((0, 3))) is known and with_margin(known, box(9.0, 0.0, 0.15)) is known


def test_swings_that_lead_over_it_are_found():
    things = outlines(box(1.0, 0.0, 0.15), 0.06)
    start = np.array([[0.7, 0.0, 0.0], [0.7, -0.4, 0.0], [0.0, 0.0, 0.0], [0.9, 0.12, 0.0]])
    over, beside, away = start.copy(), start.copy(), start.copy()
    over[0, :2], beside[0, :2], away[3, :2] = (1.3, 0.0), (1.0, 0.4), (0.7, 0.3)
    ends = np.stack((over, beside, start))
    np.testing.assert_array_equal(lead_over(things, (0, 3), start, ends), [True, False, False])
    np.testing.assert_array_equal(lead_over(things, (1, 2), start, ends), [False] * 3)
    assert not lead_over(things, (3,), start, away[None]).any(), "it stands close by and may leave"
    assert not lead_over([], (0, 3), start, ends).any()


def seen_from(first_x: float) -> tuple[GroundHeights, GroundHeights]:
    """The map before, and after a box of 0.2 m has appeared at (1, 0) of which a robot at (0, 0) sees x >= ``first_x``."""
    corner, noise = np.array([0.0, -1.0]), np.random.default_rng(0).normal(0.0, 0.001, (2, 200, 200)).astype(np.float32)
    x, y = np.meshgrid(corner[0] + 0.01 * (np.arange(200) + 0.5), corner[1] + 0.01 * (np.arange(200) + 0.5), indexing="ij")
    on_box = (np.abs(x - 1.0) < 0.1) & (np.abs(y) < 0.1)
    after = np.where(x >= first_x, noise[1] + np.where(on_box, np.float32(0.15), np.float32(0.0)), noise[0])
    return GroundHeights(1.0, corner, 0.01, noise[0]), GroundHeights(2.0, corner, 0.01, after)


@pytest.mark.parametrize(("first_x", "near_side"), [(0.5, 0.9), (0.93, 0.9), (1.0, 0.9), (1.06, 0.9)])
def test_a_box_that_is_seen_in_part_is_as_deep_as_it_is_wide(first_x, near_side):
    before, now = seen_from(first_x)
    seen = now.points_around(np.array([1.0, 0.0]), 0.6)
    seen = seen[seen[:, 2] - before.at(*seen[:, :2].T) > 0.03]
    whole = with_hidden_side(seen, before, now, 0.0)
    assert whole[:, 0].min() == pytest.approx(near_side + 0.005, abs=0.012) and whole[:, 0].max() < 1.1
    assert np.abs(whole[:, 1]).max() < 0.11 and (whole[:, 2] > 0.14).all()
    np.testing.assert_array_equal(whole[: len(seen)], seen)


def test_what_is_seen_to_end_ends_there():
    before, now = seen_from(0.5)
    heights = now.height.copy()
    heights[:95] = np.float32(0.0005)  # a bar of 0.15 m depth, seen before it: ground
    seen = box(1.0, 0.0, 0.15)
    seen = seen[seen[:, 0] > 0.95]
    assert len(with_hidden_side(seen, before, GroundHeights(2.0, now.corner, 0.01, heights), 0.0)) == len(seen)
    assert len(with_hidden_side(np.zeros((0, 3)), before, now, 0.0)) == 0
