"""The swing spline: ends, continuity, height, special cases."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.trajectory.swing_trajectory import SwingConfig, SwingSpline

P0, P1 = np.array([0.1, 0.2, 0.03]), np.array([0.45, 0.15, 0.13])
UP = np.array([0.0, 0.0, 1.0])
SLOPE = np.array([-np.sin(0.3), 0.0, np.cos(0.3)])


@pytest.fixture
def spline():
    return SwingSpline(P0, P1, 1.0, 1.4, 0.08, n1=SLOPE)


def test_ends(spline):
    eps = 1e-9
    np.testing.assert_allclose(spline.position([0.5, 1.0, 1.4, 9.0]), [P0, P0, P1, P1])
    np.testing.assert_allclose(spline.velocity(1.0 + eps), [0, 0, 0.2], atol=1e-6)
    np.testing.assert_allclose(spline.velocity(1.4 - eps), -0.4 * SLOPE, atol=1e-6)
    np.testing.assert_array_equal(spline.velocity([0.9, 1.5]), np.zeros((2, 3)))


def test_derivatives_are_those_of_the_position(spline):
    times, h = np.linspace(1.01, 1.39, 39), 1e-5
    velocity = (spline.position(times + h) - spline.position(times - h)) / (2 * h)
    acceleration = (spline.velocity(times + h) - spline.velocity(times - h)) / (2 * h)
    np.testing.assert_allclose(spline.velocity(times), velocity, atol=1e-6)
    np.testing.assert_allclose(spline.acceleration(times), acceleration, atol=5e-3)


def test_apex_stands_over_the_chord(spline):
    chord = (P1 - P0) / np.linalg.norm(P1 - P0)
    offset = spline.position(np.linspace(1, 1.4, 101)) - P0
    height = np.linalg.norm(offset - np.outer(offset @ chord, chord), axis=1)
    assert 0.0799 < height.max() < 0.09
    assert SwingSpline(P0, P1, 1.0, 1.4, 0.08, obstacle_height=0.05).position(1.2)[2] > spline.position(1.2)[2] + 0.04


def test_step_in_place_goes_straight_up():
    spline = SwingSpline(P0, P0 + UP * 0.1, 0.0, 0.4, 0.08)
    np.testing.assert_allclose(spline.position(0.2), P0 + UP * 0.18)


def test_short_swings_are_flat():
    low = SwingSpline(P0, P0, 0.0, 0.075, 0.08)
    assert low.position(0.0375)[2] == pytest.approx(P0[2] + 0.04)


def test_normal_turns_from_one_end_to_the_other(spline):
    np.testing.assert_allclose(spline.normal(1.05), [0, 0, 1])
    np.testing.assert_allclose(spline.normal(1.35), SLOPE)
    assert spline.normal(1.2) @ [0, 0, 1] == pytest.approx(np.cos(0.15))


def test_configuration_is_checked():
    with pytest.raises(UserInputError, match="touchdown_velocity"):
        SwingConfig(touchdown_velocity=0.1)
    planned = SwingSpline.plan(1.0, 1.4, P0, P1, SLOPE)
    np.testing.assert_allclose(planned.position(1.3), SwingSpline(P0, P1, 1.0, 1.4, n1=SLOPE).position(1.3))
