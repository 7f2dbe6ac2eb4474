"""What the network sees: heights of regions, the same in every place and heading, mirrored for legs of the other side."""

import numpy as np
import pytest

from quadpips_drake.baselines.learned_footholds.swing_view import INPUTS, PATCH, ground_at, swing_view
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.planning.region_table import outline_table
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.regions import PlanarRegion
from tests.baselines.hand_made import random_region, region

NOMINAL = np.array([[0.36, 0.3], [0.36, -0.3], [-0.36, 0.3], [-0.36, -0.3]])
PAIR, OTHER_PAIR = (Leg.LF, Leg.RH), (Leg.RF, Leg.LH)
CELL = 0.05


def world(rng):
    """Regions around the left fore foot, and a stance that is not the nominal one."""
    regions = [random_region(rng, k) for k in range(12)]
    moved = [with_pose(r, np.eye(3), np.array([0.4, 0.3, 0.0])) for r in regions]
    feet = np.column_stack((NOMINAL, np.zeros(4))) + rng.uniform(-0.05, 0.05, (4, 3))
    return moved, feet, np.array([0.45, 0.31])


def with_pose(region, R, p):
    X_WR = np.array(region.X_WR)
    X_WR[:3, :3], X_WR[:3, 3] = R @ X_WR[:3, :3], R @ X_WR[:3, 3] + p
    return PlanarRegion(region.id, X_WR, region.boundary, region.inset)


def test_of_several_regions_the_highest_counts_and_inclined_ones_where_they_are():
    flat, slope = region(0, (0.0, 0.0, 0.1), (1.0, 1.0)), region(1, (0.4, 0.0, 0.2), (0.4, 1.0), slope=(0.5, 0.0))
    points = np.array([[0.0, 0.0], [0.4, 0.1], [0.45, -0.3], [0.3, 0.0], [0.9, 0.0], [0.0, -0.51]])
    heights = ground_at(outline_table([flat, slope]), points)
    np.testing.assert_allclose(heights, [0.1, 0.2, 0.225, 0.15, np.nan, np.nan], atol=1e-9)
    assert np.isnan(ground_at(outline_table([]), points)).all()


def test_it_is_the_same_in_every_place_and_heading():
    regions, feet, wish = world(np.random.default_rng(1))
    here = swing_view(feet, PAIR, Leg.LF, wish, NOMINAL, CELL, outline_table(regions))
    assert here.inputs.shape == (INPUTS,) and len(np.unique(here.inputs[: PATCH**2])) > 20
    R, p = yaw_matrix(2.0), np.array([3.0, -1.0, 0.7])
    there = swing_view(
        feet @ R.T + p,
        PAIR,
        Leg.LF,
        R[:2, :2] @ wish + p[:2],
        NOMINAL,
        CELL,
        outline_table([with_pose(r, R, p) for r in regions]),
    )
    np.testing.assert_allclose(there.inputs, here.inputs, atol=1e-9)
    offset = np.array([0.1, -0.03])
    np.testing.assert_allclose(there.moved(offset), R[:2, :2] @ here.moved(offset) + p[:2], atol=1e-9)
    np.testing.assert_allclose(there.offset(there.moved(offset)), offset, atol=1e-9)


def test_a_right_leg_sees_what_a_left_one_sees_in_a_mirror():
    regions, feet, wish = world(np.random.default_rng(2))
    left = swing_view(feet, PAIR, Leg.LF, wish, NOMINAL, CELL, outline_table(regions))
    mirror = np.diag([1.0, -1.0, 1.0])
    mirrored = []
    for r in regions:
        X_WR = np.array(r.X_WR)
        X_WR[:3, :3], X_WR[:3, 3] = mirror @ X_WR[:3, :3] @ mirror, mirror @ X_WR[:3, 3]
        mirrored.append(PlanarRegion(r.id, X_WR, (r.boundary * [1.0, -1.0])[::-1], (r.inset * [1.0, -1.0])[::-1]))
    feet = (feet @ mirror)[[Leg.RF, Leg.LF, Leg.RH, Leg.LH]]
    right = swing_view(feet, OTHER_PAIR, Leg.RF, wish * [1.0, -1.0], NOMINAL, CELL, outline_table(mirrored))
    np.testing.assert_allclose(right.inputs, left.inputs, atol=1e-9)
    np.testing.assert_allclose(
        right.moved(np.array([0.1, 0.05])), left.moved(np.array([0.1, 0.05])) * [1.0, -1.0], atol=1e-9
    )


def test_on_level_ground_in_the_nominal_stance_there_is_nothing_to_see_but_the_way():
    feet = np.column_stack((NOMINAL, np.full(4, 0.2)))
    ground = outline_table([region(0, (0.0, 0.0, 0.2), (4.0, 4.0))])
    for leg in PAIR:
        view = swing_view(feet, PAIR, leg, NOMINAL[leg] + [0.1, 0.0], NOMINAL, CELL, ground)
        np.testing.assert_allclose(view.inputs[:-3], 0.0, atol=1e-9)
        np.testing.assert_allclose(view.inputs[-3:], [0.1, 0.0, leg.fore], atol=1e-9)
    nothing = swing_view(feet, PAIR, Leg.LF, NOMINAL[Leg.LF], NOMINAL, CELL, outline_table([]))
    assert np.all(nothing.inputs[: PATCH**2] == nothing.inputs[0]) and nothing.inputs[0] == pytest.approx(-6 * CELL)


def test_with_fewer_than_two_feet_on_the_ground_there_is_no_view():
    feet = np.column_stack((NOMINAL, np.zeros(4)))
    assert swing_view(feet, (Leg.LF, Leg.RF, Leg.LH), Leg.LF, NOMINAL[0], NOMINAL, CELL, outline_table([])) is None
    assert swing_view(feet, (Leg.LF,), Leg.LF, NOMINAL[0], NOMINAL, CELL, outline_table([])) is not None
