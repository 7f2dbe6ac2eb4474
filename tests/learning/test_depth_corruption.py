"""The domain alignment."""

import cv2
import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.learning.depth_corruption import CorruptionConfig, corrupt_depth, object_boundaries, oil_paint
from quadpips_drake.sensing.depth_noise import DepthNoiseConfig

SHAPE = (60, 80)


def box_on_floor():
    """Depth with a box in the middle, and its labels."""
    depth, labels = np.full(SHAPE, 2.0, np.float32), np.full(SHAPE, 1, np.uint8)
    depth[20:40, 30:50], labels[20:40, 30:50] = 1.5, 3
    return depth, labels


def test_the_same_generator_gives_the_same_image():
    depth, labels = box_on_floor()
    first, second = (corrupt_depth(depth, labels, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(first, corrupt_depth(depth, labels, np.random.default_rng(8)), equal_nan=True)


def test_input_stays_as_it_is_and_nothing_is_invented():
    depth, labels = box_on_floor()
    depth[:10] = np.nan
    before = depth.copy()
    for seed in range(5):
        noisy = corrupt_depth(depth, labels, np.random.default_rng(seed))
        assert noisy.dtype == np.float32 and noisy.shape == SHAPE
        assert np.isnan(noisy[:8]).all()
    np.testing.assert_array_equal(depth, before)


def test_without_noise_only_boundaries_change():
    depth, labels = box_on_floor()
    config = CorruptionConfig(boundary_width=2, boundary_voids=0, surface_voids=0, blots=0, noise=DepthNoiseConfig())
    for seed in range(5):
        noisy = corrupt_depth(depth, labels, np.random.default_rng(seed), config)
        border = object_boundaries(depth, labels, config.boundary_jump, 2)
        np.testing.assert_array_equal(noisy[~border], depth[~border])
        assert (noisy[border] != depth[border]).any()


def test_holes_are_connected_and_about_as_large_as_asked():
    depth, labels = box_on_floor()
    config = CorruptionConfig(boundary_voids=0, surface_voids=0.2, blots=0, boundary_noise=0, noise=DepthNoiseConfig())
    shares, sizes = [], []
    for seed in range(20):
        lost = np.isnan(corrupt_depth(depth, labels, np.random.default_rng(seed), config))
        shares.append(lost.mean())
        groups, _ = cv2.connectedComponents(lost.astype(np.uint8))
        sizes.append(lost.sum() / max(groups - 1, 1))
    assert 0.05 < np.mean(shares) < 0.15
    assert np.mean(sizes) > 5


def test_oil_paint_takes_the_commonest_level():
    depth = np.full((5, 5), 1.0, np.float32)
    depth[:, 3:] = 2.0
    painted = oil_paint(depth, np.array([2, 2]), np.array([2, 4]), 1, 12)
    np.testing.assert_allclose(painted, [1.0, 2.0])
    depth[:] = np.nan
    assert np.isnan(oil_paint(depth, np.array([2]), np.array([2]), 1, 12)).all()


def test_bad_settings_are_refused():
    with pytest.raises(UserInputError, match="blots"):
        CorruptionConfig(blots=2.0)
    with pytest.raises(UserInputError, match="oil_radius"):
        CorruptionConfig(oil_radius=-1)
