"""What the elevation map believes: fusion, gate, clean-up, memory, and images that are nonsense."""

import dataclasses

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.elevation.elevation_config import (
    FINE,
    PAPER,
    ElevationConfig,
    ElevationMapConfig,
    with_preset,
)
from quadpips_drake.perception.elevation.elevation_mapping import DepthView, begin_map, update_map
from quadpips_drake.values.regions import ElevationMap
from tests.perception.scenes import (
    FEET,
    MEDIUM,
    Scene,
    base_pose,
    camera_mount,
    stepping_stones,
    walking_poses,
)

CONFIG = with_preset(ElevationMapConfig(), FINE)
NOTHING_ASSUMED = {"assumed_behind": 0.0, "assumed_ahead": 0.0, "assumed_half_width": 0.0}
UNASSUMED = dataclasses.replace(CONFIG, **NOTHING_ASSUMED)


def view(depth, X_WB):
    return DepthView(X_WB @ camera_mount(), MEDIUM, depth.astype(np.float32))


def look_at(scene, poses, config=CONFIG, elevation=None, noise=None):
    """Returns the map after looking at ``scene`` from ``poses`` (t, X_WB, yaw)."""
    for stamp, X_WB, _ in poses:
        depth = scene.depth(X_WB @ camera_mount(), MEDIUM)
        views = [view(depth if noise is None else noise(depth), X_WB)]
        if elevation is None:
            elevation = begin_map(stamp, views, X_WB, FEET, config)
        else:
            elevation = update_map(elevation, stamp, views, X_WB, config)
    return elevation


def standing(count, start=0.0):
    return [(start + k / 30.0, base_pose(), 0.0) for k in range(count)]


def cell_of(elevation, x, y):
    i, j = np.floor(np.array([x, y]) / elevation.cell).astype(int) - elevation.first_cell
    assert min(i, j) >= 0 and max(i, j) < len(elevation.height), "outside of the window"
    return int(i), int(j)


def test_a_floor_is_where_it_is():
    elevation = look_at(Scene([], floor=0.1), standing(1), UNASSUMED)
    known = elevation.height[np.isfinite(elevation.height)]
    assert known.size > 800
    np.testing.assert_allclose(known, 0.1, atol=1e-4)
    assert np.isfinite(elevation.variance[np.isfinite(elevation.height)]).all()


def test_stones_and_the_pit_between_them():
    scene = stepping_stones()
    elevation = look_at(scene, walking_poses(0.5, speed=0.5, rate=10.0))
    n = len(elevation.height)
    i, j = np.nonzero(np.isfinite(elevation.height))
    x, y = ((elevation.first_cell[k] + index + 0.5) * elevation.cell for k, index in ((0, i), (1, j)))
    inside = scene.edge_distances(np.column_stack([x, y]))
    height = elevation.height[i, j]
    assert (np.abs(height[inside > 0.022]) < 0.005).mean() > 0.99
    assert (height[inside < -0.03] < -0.1).mean() > 0.95
    assert 0.2 * n * n < len(i)


def test_noise_averages_out():
    rng = np.random.default_rng(0)

    def spoil(depth):
        sigma = 0.001 + 0.004 * np.where(np.isfinite(depth), depth, 0.0) ** 2
        return depth + sigma * rng.standard_normal(depth.shape)

    one, many = (look_at(Scene([]), standing(count), UNASSUMED, noise=spoil) for count in (1, 20))
    error = [np.nanstd(elevation.height) for elevation in (one, many)]
    assert error[1] < 0.8 * error[0] and error[1] < 0.003
    assert np.nanmedian(many.variance) <= np.nanmedian(one.variance)


def fused(heights, config=UNASSUMED):
    """Height and variance of one cell of floors at ``heights`` [m], one image after the other, none of which cleans."""
    elevation, config = None, dataclasses.replace(config, clean_up_period=100.0)
    for k, height in enumerate(heights):
        elevation = look_at(Scene([], floor=height), [(k / 30.0, base_pose(), 0.0)], config, elevation)
    cell = cell_of(elevation, 1.0, 0.1)
    return float(elevation.height[cell]), float(elevation.variance[cell])


def test_within_the_gate_heights_are_fused_and_outside_of_it_doubted():
    height, variance = fused([0.0, 0.02])
    assert 0.005 < height < 0.015 and variance == pytest.approx(UNASSUMED.min_variance)
    height, variance = fused([0.0, 0.1])
    assert height == pytest.approx(0.0, abs=1e-4)
    assert variance == pytest.approx(UNASSUMED.min_variance + UNASSUMED.multi_height_variance, rel=1e-3)
    height, _ = fused([0.0] + [0.1] * 8)
    assert height == pytest.approx(0.1, abs=0.01), "doubted often enough"


def test_what_the_camera_sees_through_is_removed():
    box = Scene([[0.9, 1.1, -0.1, 0.1, 0.0, 0.2]])
    with_box = look_at(box, standing(3), UNASSUMED)
    cell = cell_of(with_box, 0.95, 0.0)
    assert with_box.height[cell] == pytest.approx(0.2, abs=0.01)
    gone = look_at(Scene([]), standing(2, start=1.0), UNASSUMED, with_box)
    assert gone.height[cell] == pytest.approx(0.0, abs=0.01)
    slow = dataclasses.replace(UNASSUMED, clean_up_period=10.0)
    still = look_at(Scene([]), standing(2, start=1.0), slow, with_box)
    assert still.height[cell] == pytest.approx(0.2, abs=0.02)


def test_a_slab_is_not_lost_to_the_floor_below_it():
    """Seen from the side, under the slab."""
    slab = Scene([[0.4, 0.8, -0.3, 0.3, -0.03, 0.0]], floor=-0.6)
    over = look_at(slab, [(k / 30.0, base_pose(x=-0.4), 0.0) for k in range(3)], UNASSUMED)
    cell = cell_of(over, 0.7, 0.0)
    assert over.height[cell] == pytest.approx(0.0, abs=0.01)
    below = look_at(slab, [(1 + k / 30.0, base_pose(x=-0.4, height=0.2), 0.0) for k in range(30)], UNASSUMED, over)
    assert below.height[cell] == pytest.approx(0.0, abs=0.01)


def test_the_map_travels_in_whole_cells_and_keeps_what_it_knows():
    before = look_at(Scene([], floor=0.02), standing(2), UNASSUMED)
    X_WB = base_pose(x=0.2, y=-0.1)
    after = update_map(before, 1.0, [view(np.zeros((240, 320)), X_WB)], X_WB, UNASSUMED)
    i, j = (after.first_cell - before.first_cell).tolist()
    assert (i, j) == (6, -4)
    np.testing.assert_array_equal(after.height[:-6, 4:], before.height[6:, :-4])
    assert np.isnan(after.height[-6:]).all() and np.isnan(after.height[:, :4]).all()


def test_ground_is_assumed_at_the_start_until_it_is_measured():
    elevation = look_at(Scene([], floor=-0.3), standing(1))
    assert elevation.height[cell_of(elevation, -0.3, 0.0)] == pytest.approx(0.0, abs=1e-6)
    assert elevation.height[cell_of(elevation, 1.2, 0.0)] == pytest.approx(-0.3, abs=0.01)
    there = look_at(
        Scene([], floor=-0.05), [(1.0, base_pose(x=-0.9), 0.0)], dataclasses.replace(CONFIG, max_jump=9.0), elevation
    )
    assert there.height[cell_of(there, 0.0, 0.0)] == pytest.approx(-0.05, abs=0.01)


def test_an_outlier_does_not_take_the_place_of_assumed_ground():
    """A point just before the camera, high over ground that no image shows."""
    depth = np.full((240, 320), np.nan)
    depth[150:155, 150:155] = 0.12
    X_WB = base_pose()
    elevation = begin_map(0.0, [view(depth, X_WB)], X_WB, FEET, CONFIG)
    np.testing.assert_allclose(elevation.height[np.isfinite(elevation.height)], 0.0, atol=1e-6)


@pytest.mark.parametrize("pose", [base_pose(x=0.8), base_pose(yaw=1.0)])
def test_a_jump_of_the_pose_starts_afresh(pose):
    before = look_at(Scene([]), standing(3))
    after = update_map(before, 1.0, [view(np.full((240, 320), np.nan), pose)], pose, CONFIG)
    assert np.isfinite(before.height).any() and not np.isfinite(after.height).any()


BAD = {
    "nan": np.full((240, 320), np.nan),
    "minus inf": np.full((240, 320), -np.inf),
    "zero": np.zeros((240, 320)),
    "negative": np.full((240, 320), -1.0),
    "empty": np.zeros((0, 0)),
    "too near": np.full((240, 320), 1e-30),
}


@pytest.mark.parametrize("preset", [FINE, PAPER])
@pytest.mark.parametrize("name", BAD)
def test_a_bad_image_changes_nothing(name, preset):
    config = with_preset(ElevationMapConfig(**NOTHING_ASSUMED), preset)
    before = look_at(Scene([]), standing(2), config)
    after = update_map(before, 1.0, [view(BAD[name], base_pose())], base_pose(), config)
    np.testing.assert_array_equal(after.height, before.height)
    start = begin_map(0.0, [view(BAD[name], base_pose())], base_pose(), FEET, config)
    assert not np.isfinite(start.height).any()


@pytest.mark.parametrize("depth", [np.inf, 65.535, 1e38])
def test_a_saturated_image_shows_free_space_and_no_ground(depth):
    before = look_at(Scene([]), standing(2), UNASSUMED)
    after = update_map(before, 1.0, [view(np.full((240, 320), depth), base_pose())], base_pose(), UNASSUMED)
    assert np.isfinite(before.height).sum() > 800
    assert np.isfinite(after.height).sum() < 0.1 * np.isfinite(before.height).sum(), "but for the rim of the image"


@pytest.mark.parametrize("spoil", ["pose", "stamp", "old stamp"])
def test_without_pose_or_time_nothing_changes(spoil):
    before = look_at(Scene([]), standing(2))
    X_WB = np.full((4, 4), np.nan) if spoil == "pose" else base_pose()
    stamp = {"stamp": np.nan, "old stamp": before.stamp}.get(spoil, 1.0)
    assert update_map(before, stamp, [view(np.ones((240, 320)), X_WB)], X_WB, CONFIG) is before
    if spoil != "old stamp":
        start = begin_map(stamp, [view(np.ones((240, 320)), X_WB)], X_WB, FEET, CONFIG)
        assert start.stamp == -np.inf and not np.isfinite(start.height).any()


def test_the_same_images_give_the_same_bits():
    one, two = (look_at(stepping_stones(), walking_poses(0.2, speed=0.5, rate=10.0)) for _ in range(2))
    np.testing.assert_array_equal(one.height, two.height)
    np.testing.assert_array_equal(one.variance, two.variance)


def test_presets_fill_in_what_is_null_and_nothing_else():
    paper = ElevationConfig(preset=PAPER, map=ElevationMapConfig(layer=0.02)).filled()
    assert (paper.map.cell, paper.map.layer, paper.planes.resample) == (0.06, 0.02, 0.04)
    assert ElevationConfig().filled().map.cell == 0.03
    with pytest.raises(UserInputError, match="preset"):
        ElevationConfig(preset="coarse")
    with pytest.raises(UserInputError, match="half_extent"):
        ElevationConfig(map=ElevationMapConfig(half_extent=0.2))
    assert ElevationMap.empty().height.shape == (0, 0)
