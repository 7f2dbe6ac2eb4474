"""The network's input channels."""

import numpy as np
import pytest

from quadpips_drake.learning.features import CHANNELS, make_features, scaled_intrinsics
from tests.learning.small import DOWN_C, SMALL, floor_depth


def channel(features, name):
    return features[CHANNELS.index(name)]


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
