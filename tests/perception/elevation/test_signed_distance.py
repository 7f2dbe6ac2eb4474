"""The signed distance from the ground: against planes and boxes, between its points, and of maps that are nonsense."""

import dataclasses

import numpy as np
import pytest

from quadpips_drake.math.trilinear import trilinear
from quadpips_drake.perception.elevation.elevation_config import DistanceConfig
from quadpips_drake.perception.elevation.signed_distance import signed_distance
from quadpips_drake.values.regions import ElevationMap
from tests.perception.elevation.maps import ideal_map
from tests.perception.scenes import Scene

CONFIG = DistanceConfig()
CELL = 0.03


def field_of(scene, base=(0.0, 0.0, 0.5), config=CONFIG):
    elevation = ideal_map(scene)
    X_WB = np.eye(4)
    X_WB[:3, 3] = base
    return signed_distance(dataclasses.replace(elevation, X_WB=X_WB), config)


def at(field, *place):
    inside, value, *gradient = trilinear(field.distance, np.array(field.origin), field.step, *place)
    assert inside
    return value, np.array(gradient)


@pytest.mark.parametrize("z", [-0.05, 0.04, 0.2, 0.5])
def test_over_a_floor_it_is_the_height(z):
    value, gradient = at(field_of(Scene([])), 0.1, -0.2, z)
    assert value == pytest.approx(z, abs=0.6 * CELL)
    np.testing.assert_allclose(gradient, [0.0, 0.0, 1.0], atol=1e-6)


def test_beside_a_box_it_is_the_distance_from_its_side():
    field = field_of(Scene([[0.3, 0.9, -0.4, 0.4, 0.0, 0.3]]))
    value, gradient = at(field, 0.2, 0.0, 0.2)
    assert value == pytest.approx(0.1, abs=0.6 * CELL)
    np.testing.assert_allclose(gradient, [-1.0, 0.0, 0.0], atol=1e-3)
    value, gradient = at(field, 0.45, 0.0, 0.29)
    assert value == pytest.approx(-0.01, abs=0.7 * CELL)
    diagonal, _ = at(field, 0.2, 0.0, 0.4)
    assert diagonal == pytest.approx(np.hypot(0.1, 0.1), abs=CELL)


def test_between_the_points_it_is_trilinear():
    rng = np.random.default_rng(0)
    samples = rng.normal(size=(4, 5, 6)).astype(np.float32)
    origin, step, tiny = np.array([0.3, -0.2, 0.1]), 0.05, 1e-6
    for index in ((0, 0, 0), (3, 4, 5), (1, 2, 3)):
        inside, value, *_ = trilinear(
            samples, origin, step, *(origin + step * np.array(index) - 1e-12 * (np.array(index) > 0))
        )
        assert inside and value == pytest.approx(float(samples[index]), abs=1e-6)
    for _ in range(20):
        place = origin + step * rng.uniform(0.1, 2.9, 3)
        inside, value, *gradient = trilinear(samples, origin, step, *place)
        assert inside
        for axis in range(3):
            moved = np.array(place)
            moved[axis] += tiny
            assert (trilinear(samples, origin, step, *moved)[1] - value) / tiny == pytest.approx(gradient[axis], abs=1e-3)


def test_outside_of_its_points_nothing_is_said():
    field = field_of(Scene([]))
    for place in ((0.0, 0.0, 5.0), (2.0, 0.0, 0.2), (0.0, -2.0, 0.2), (0.0, 0.0, np.nan)):
        assert trilinear(field.distance, np.array(field.origin), field.step, *place) == (False, 0.0, 0.0, 0.0, 0.0)


def test_a_pit_is_left_out_below_what_matters():
    shallow = field_of(Scene([[-0.5, 0.5, -0.5, 0.5, -3.0, 0.0]], floor=-3.0))
    assert shallow.distance.shape[2] < 50
    assert at(shallow, 0.0, 0.0, 0.3)[0] == pytest.approx(0.3, abs=0.6 * CELL)


@pytest.mark.parametrize("bad", ["empty", "unknown", "pose", "far away", "one cell"])
def test_without_ground_it_is_empty(bad):
    elevation = ideal_map(Scene([]))
    X_WB = np.eye(4)
    X_WB[:3, 3] = {"pose": np.nan, "far away": 50.0}.get(bad, 0.5)
    elevation = dataclasses.replace(elevation, X_WB=X_WB)
    if bad == "empty":
        elevation = ElevationMap.empty()
    elif bad in ("unknown", "one cell"):
        height = np.full_like(elevation.height, np.nan)
        height[0, 0] = 0.0 if bad == "one cell" else np.nan
        elevation = dataclasses.replace(elevation, height=height)
    field = signed_distance(elevation, CONFIG)
    assert (field.distance.size == 0) == (bad != "one cell")
    assert np.isfinite(field.distance).all()
