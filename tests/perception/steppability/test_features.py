"""The network's input channels."""

import numpy as np
import pytest

from quadpips_drake.perception.steppability.features import CHANNELS, MAX_DEPTH, make_features, scaled_intrinsics
from quadpips_drake.values.sensing import CameraIntrinsics
from tests.learning.small import DOWN_C, SMALL, floor_depth


def channel(features, name):
    return features[CHANNELS.index(name)]


def reference(depth, axes, k):
    """Inverse depth, height, normal and validity in float64, (6, height, width); ``axes``: rows up, right, forward in C."""
    z = np.pad(np.where((depth > 0) & (depth <= MAX_DEPTH), depth, 0.0).astype(float), 2)
    v, u = np.mgrid[-2 : depth.shape[0] + 2, -2 : depth.shape[1] + 2]
    point = z[..., None] * np.stack([(u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(z.shape)], axis=-1)
    steps, known = [], z > 0
    for axis in (1, 0):
        ends = []
        for shift in (2, -2):
            near = (np.roll(z, shift, axis) > 0) & (np.abs(np.roll(z, shift, axis) - z) < 0.1 * z)
            ends.append((near, np.where(near[..., None], np.roll(point, shift, axis), point)))
        known &= ends[0][0] | ends[1][0]
        steps.append(ends[1][1] - ends[0][1])
    normal = np.cross(steps[1], steps[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = np.where(known[..., None], normal / np.linalg.norm(normal, axis=-1, keepdims=True), 0.0)
        inverse = np.where(z > 0, 1 / z, 0.0)
    return np.stack([inverse, point @ axes[0], *np.moveaxis(normal @ axes.T, -1, 0), z > 0])[:, 2:-2, 2:-2]


def test_features_are_those_of_the_formula():
    """Single precision against double."""
    rng = np.random.default_rng(0)
    depth = floor_depth(0.5)
    depth[10:30, 20:40] *= 0.7
    depth += rng.normal(0.0, 0.002, depth.shape).astype(np.float32)
    depth[rng.random(depth.shape) < 0.1] = np.nan
    right = np.array([1.0, 0.0, 0.0])
    features = make_features(depth, DOWN_C, SMALL)
    np.testing.assert_allclose(
        features[:6], reference(depth, np.stack([-DOWN_C, right, np.cross(-DOWN_C, right)]), SMALL), atol=2e-4
    )


def test_level_ground_has_one_height_and_an_upward_normal():
    depth = floor_depth(0.5)
    features = make_features(depth, DOWN_C, SMALL)
    seen = np.isfinite(depth) & (depth <= 3.0)
    np.testing.assert_array_equal(channel(features, "valid"), seen)
    np.testing.assert_allclose(channel(features, "height")[seen], -0.5, atol=1e-5)
    np.testing.assert_allclose(channel(features, "inverse_depth")[seen], 1 / depth[seen], rtol=1e-5)
    near = seen & (depth < 1.0)
    np.testing.assert_allclose(channel(features, "normal_up")[near], 1, atol=1e-3)
    assert np.abs(channel(features, "normal_right")[near]).max() < 1e-3


def test_a_wall_ahead_has_a_normal_towards_the_camera():
    depth = np.full((48, 64), 2.0, np.float32)
    features = make_features(depth, np.array([0.0, 1.0, 0.0]), SMALL)
    np.testing.assert_allclose(channel(features, "normal_forward"), -1, atol=1e-4)
    np.testing.assert_allclose(channel(features, "normal_up"), 0, atol=1e-4)


def test_drops_and_rises_are_the_height_of_a_step():
    """A level camera 0.6 m above the ground, in front of a step of 0.2 m that it sees from above."""
    size, focal = (120, 160), 80.0
    intrinsics = CameraIntrinsics(size[1], size[0], focal, focal, 79.5, 19.5)
    rays = (np.arange(size[0]) - intrinsics.cy) / focal
    with np.errstate(divide="ignore", invalid="ignore"):
        ground, top = np.where(rays > 0, 0.6 / rays, np.inf), np.where(rays > 0, 0.4 / rays, np.inf)
    row = np.where(ground < 0.8, ground, np.where(0.8 * rays > 0.4, 0.8, top))
    depth = np.repeat(row[:, None], size[1], axis=1).astype(np.float32)
    features = make_features(depth, np.array([0.0, 1.0, 0.0]), intrinsics)
    drop, rise = channel(features, "drop_13")[:, 80], channel(features, "rise_13")[:, 80]
    on_face = np.nonzero(row == 0.8)[0]
    middle = on_face[len(on_face) // 2]
    assert drop[middle] + rise[middle] == pytest.approx(0.2, abs=0.02)
    assert drop[on_face[1]] > drop[middle] > drop[on_face[-2]] > -1e-3
    near, far = np.argmin(np.abs(row - 0.5)), np.argmin(np.abs(row - 2.5))
    assert abs(drop[near]) < 1e-3 and abs(rise[near]) < 1e-3, "level ground has neither"
    assert abs(rise[far]) < 1e-3


def test_lost_pixels_change_drops_and_rises_little():
    depth = floor_depth(0.5)
    depth[10:30, 20:40] *= 0.8
    holes = np.random.default_rng(0).random(depth.shape) < 0.3
    whole = make_features(depth, DOWN_C, SMALL)
    depth[holes] = np.nan
    sparse = make_features(depth, DOWN_C, SMALL)
    assert not sparse[:, holes].any()
    for name in CHANNELS[6:]:
        difference = np.abs(channel(sparse, name) - channel(whole, name))[(channel(sparse, "valid") > 0)]
        assert np.median(difference) < 0.01


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, -1.0, 3.5, 1e30])
def test_what_is_not_measured_is_zero_everywhere(value):
    features = make_features(np.full((48, 64), value, np.float32), DOWN_C, SMALL)
    assert not features.any()


@pytest.mark.parametrize("down_C", [np.zeros(3), np.full(3, np.nan), np.array([0.0, 0.0, 1.0])])
def test_a_strange_direction_of_gravity_gives_finite_features(down_C):
    assert np.isfinite(make_features(floor_depth(), down_C, SMALL)).all()


def test_mirrored_depth_gives_mirrored_features():
    depth = floor_depth()
    depth[:, :20] *= 0.9
    features = make_features(depth, DOWN_C, SMALL)
    mirrored = make_features(depth[:, ::-1], DOWN_C, SMALL)[:, :, ::-1]
    mirrored[CHANNELS.index("normal_right")] *= -1
    np.testing.assert_allclose(features, mirrored, atol=1e-4)


def test_thinned_out_images_have_the_same_rays():
    half = scaled_intrinsics(SMALL, 2)
    assert (half.width, half.height) == (32, 24)
    assert (10 - half.cx) / half.fx == pytest.approx((20 - SMALL.cx) / SMALL.fx)
