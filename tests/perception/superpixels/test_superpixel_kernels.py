"""The kernels of the superpixels against their readable versions, RANSAC against outliers."""

import numpy as np
import pytest

from quadpips_drake.perception.superpixels import superpixel_kernels as kernels
from quadpips_drake.perception.superpixels.superpixels import SuperpixelConfig, cap_points, healthy_pixels
from quadpips_drake.values.images import EgocanImage
from tests.perception.superpixels import superpixel_reference as reference

CONFIG = SuperpixelConfig()
WEIGHTS = (12.5, 100.0, 25.0, 0.0)
RANSAC = (CONFIG.ransac_iterations, CONFIG.ransac_samples, CONFIG.ransac_threshold, CONFIG.seed)


@pytest.fixture(params=[0.0125, 0.0], ids=["straight down", "central"])
def can(request):
    """A rough cap of 40 x 48 pixels with steps, holes, tilted and forbidden pixels."""
    rng = np.random.default_rng(4)
    v, u = np.mgrid[:40, :48]
    height = 0.5 + 0.05 * (u > 20) + 0.1 * (v > 27) + 0.003 * rng.standard_normal(v.shape)
    height[rng.random(v.shape) < 0.1] = np.nan
    height[3:5, 4:9] = 3.0
    normals = np.stack([0.1 * rng.standard_normal(v.shape), -np.ones(v.shape), 0.1 * rng.standard_normal(v.shape)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    labels = rng.choice([0, 1, 2, 3], v.shape, p=[0.4, 0.5, 0.06, 0.04])
    return EgocanImage(
        stamp=0.0,
        X_WE=np.eye(4),
        cap_height=height.astype(np.float32),
        cap_normals=normals.astype(np.float32),
        cap_labels=labels.astype(np.uint8),
        cap_focal=50.0,
        cap_pixel=request.param,
    )


def test_health_check(can):
    np.testing.assert_allclose(cap_points(can), reference.points_of(can), rtol=1e-5, atol=1e-6)
    healthy = healthy_pixels(can, CONFIG)
    np.testing.assert_array_equal(healthy, reference.healthy_pixels(can, CONFIG))
    assert 0.3 < healthy.mean() < 0.8


def seeded(can):
    points, healthy = cap_points(can), healthy_pixels(can, CONFIG)
    planes, active = kernels.healthy_planes(points, can.cap_normals, healthy)
    clusters = kernels.seed_clusters(points, can.cap_normals, healthy, 10, np.empty((0, 9)), 0.015)
    return points, healthy, planes, active, clusters


def test_seeds_lie_on_healthy_pixels_near_the_grid(can):
    points, healthy, _, _, clusters = seeded(can)
    u, v = clusters[:, 0].astype(int), clusters[:, 1].astype(int)
    assert len(clusters) == 4 * 5 and healthy[v, u].all()
    grid = np.array([(a, b) for b in range(5, 40, 10) for a in range(5, 48, 10)])
    assert np.abs(clusters[:, :2] - grid).max() <= 2
    np.testing.assert_array_equal(clusters[:, 2:5], points[v, u])


def test_each_healthy_pixel_goes_to_the_nearest_cluster(can):
    points, healthy, planes, _, clusters = seeded(can)
    assignment, best = np.empty(healthy.shape, np.int32), np.empty(healthy.shape, np.float32)
    kernels.assign_pixels(planes, clusters, 10, WEIGHTS, best, assignment)
    table = reference.assign(points, can.cap_normals, healthy, clusters, 10, WEIGHTS)
    assert (assignment[~healthy] == -1).all()
    chosen = assignment[healthy]
    assert (chosen >= 0).all() == np.isfinite(table.min(axis=1)).all()
    np.testing.assert_allclose(table[np.arange(len(chosen)), chosen], table.min(axis=1), rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(best[healthy], table.min(axis=1), rtol=1e-3, atol=1e-4)


def test_update_takes_the_mean_and_the_plane_of_the_pixels(can):
    points, healthy, planes, active, clusters = seeded(can)
    assignment, best = np.empty(healthy.shape, np.int32), np.empty(healthy.shape, np.float32)
    kernels.assign_pixels(planes, clusters, 10, WEIGHTS, best, assignment)
    assignment[assignment == 3] = -1
    kernels.update_clusters(points, can.cap_normals, assignment, active, clusters, (0, 10, 0.01, 1))
    assert np.isnan(clusters[3]).all()
    for c in set(range(len(clusters))) - {3}:
        mine = assignment == c
        normal = can.cap_normals[mine].mean(axis=0)
        expected = [
            *np.argwhere(mine).mean(axis=0)[::-1],
            *points[mine].mean(axis=0),
            *normal / np.linalg.norm(normal),
            mine.sum(),
        ]
        np.testing.assert_allclose(clusters[c], expected, rtol=1e-4, atol=1e-5)


def test_split_is_the_components_of_each_cluster(can):
    points, healthy, planes, active, clusters = seeded(can)
    assignment, best = np.empty(healthy.shape, np.int32), np.empty(healthy.shape, np.float32)
    kernels.assign_pixels(planes, clusters, 10, WEIGHTS, best, assignment)
    expected, expected_count = reference.split(points, can.cap_normals, assignment, 0.01, 4)
    count = kernels.split_clusters(points, can.cap_normals, assignment, active, 0.01, 4)
    assert count == expected_count > 20
    np.testing.assert_array_equal(assignment, expected)


@pytest.mark.parametrize("outliers", [0.0, 0.3])
def test_ransac_finds_the_plane_of_the_majority(outliers):
    """Equations 11-14: neither a mean of normals nor a mean of points helps, with a step among them."""
    rng = np.random.default_rng(2)
    v, u = np.mgrid[:16, :16]
    normal = np.array([0.2, -1.0, 0.1]) / np.linalg.norm([0.2, -1.0, 0.1])
    y = 0.5 + 0.2 * 0.01 * u + 0.1 * 0.01 * v + 0.001 * rng.standard_normal(v.shape)
    y[rng.random(v.shape) < outliers] += 0.06
    points = np.stack([0.01 * u, y, 0.01 * v], axis=-1).astype(np.float32)
    normals = np.tile(np.float32([0.0, -1.0, 0.0]), (16, 16, 1))
    assignment, cluster = np.zeros((16, 16), np.int32), np.zeros((1, 9))
    kernels.update_clusters(points, normals, assignment, np.arange(256), cluster, RANSAC)
    assert cluster[0, 5:8] @ normal > np.cos(np.deg2rad(0.6))
    expected = 0.5 + 0.2 * cluster[0, 2] + 0.1 * cluster[0, 4]
    assert abs(cluster[0, 3] - expected) < 0.001
