"""The swing spline: ends, continuity, height, special cases."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.trajectory.swing.ground_profile import KnownGround, ground_profile
from quadpips_drake.trajectory.swing.swing_trajectory import SwingConfig, SwingSpline
from quadpips_drake.values.regions import GroundHeights, PlanarRegion

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


def square_region(center, half=0.15):
    corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    pose = np.eye(4)
    pose[:3, 3] = center
    return PlanarRegion(0, pose, corners, corners)


def test_ground_profile_follows_regions_and_expects_steps():
    radius, low, high = 0.03, square_region([0.0, 0.0, 0.0]), square_region([0.35, 0.0, 0.1])
    p0, p1 = np.array([0.0, 0.0, radius]), np.array([0.35, 0.0, 0.1 + radius])
    known = ground_profile(p0, p1, (low, high), radius)
    parts = np.linspace(0.0, 1.0, len(known))
    edge = (0.35 - 0.15 - radius) / 0.35
    np.testing.assert_allclose(known[parts < edge - 0.05], radius)
    np.testing.assert_allclose(known[parts > edge + 0.05], 0.1 + radius)
    expected = ground_profile(p0, p1)
    assert expected[0] == p0[2] and (expected[parts > 0.3] == p1[2]).all()
    np.testing.assert_allclose(ground_profile(p1, p0), expected[::-1])
    slope = ground_profile(p0, p0 + np.array([0.3, 0.0, 0.015]))
    np.testing.assert_allclose(slope, p0[2] + 0.015 * parts)


@pytest.mark.parametrize("rise", [-0.15, -0.1, 0.1, 0.15])
@pytest.mark.parametrize("edge", [0.08, 0.15, 0.3, 0.5, 0.7, 0.85, 0.92])
def test_swings_clear_the_edges_of_steps(rise, edge):
    p1 = P0 + np.array([0.3, 0.0, rise])
    parts = np.linspace(0.0, 1.0, 25)
    profile = P0[2] + rise * (parts >= edge)
    spline = SwingSpline(P0, p1, 0.0, 0.4, profile=profile)
    path = spline.position(np.linspace(0.0, 0.4, 200))
    ground = P0[2] + rise * (path[:, 0] > P0[0] + 0.3 * edge)
    assert (path[:, 2] - ground).min() > -0.002
    over_edge = np.abs(path[:, 0] - P0[0] - 0.3 * edge) < 0.01
    assert path[over_edge, 2].min() > max(P0[2], p1[2]) + 0.005
    assert path[:, 2].max() < max(P0[2], p1[2]) + 0.2


def test_level_ground_does_not_change_a_swing(spline):
    level = P0 + np.array([0.3, 0.1, 0.0])
    plain, checked = (SwingSpline(P0, level, 0.0, 0.4, profile=profile) for profile in (None, np.full(25, P0[2])))
    times = np.linspace(0.0, 0.4, 50)
    np.testing.assert_array_equal(plain.sample(times), checked.sample(times))


def ground_of(top, x_range=(-0.3, 1.0), y_range=(-0.5, 0.5), cell=0.01) -> GroundHeights:
    """Heights on a grid as the function ``top(x, y)`` of arrays gives them."""
    x, y = (np.arange(low + cell / 2, high, cell) for low, high in (x_range, y_range))
    corner = np.array([x_range[0], y_range[0]])
    return GroundHeights(0.0, corner, cell, top(x[:, None], y[None, :]).astype(np.float32))


def barrier(x, y):
    """12 cm high and 4 cm thick, across the way."""
    return np.where(np.abs(x - 0.2) < 0.02, 0.12, 0.0) + 0.0 * y


def pegs(x, y):
    """Columns of 10 cm with gaps of 6 cm; every other one is 5 cm higher."""
    i, j = np.floor(x / 0.16), np.floor(y / 0.16)
    on_top = (x - 0.16 * i < 0.10) & (y - 0.16 * j < 0.10)
    return np.where(on_top, 0.05 * ((i + j) % 2), -0.30)


def rubble(x, y):
    """Boxes of 20 cm, each as high as chance has it, up to 8 cm."""
    heights = np.random.default_rng(3).uniform(0.0, 0.08, (20, 20))
    return heights[np.floor(x / 0.2).astype(int) % 20, np.floor(y / 0.2).astype(int) % 20]


@pytest.mark.parametrize(("world", "start", "end"), [
    (barrier, (0.0, 0.0), (0.4, 0.0)),
    (barrier, (0.1, -0.05), (0.32, 0.1)),
    (pegs, (0.05, 0.05), (0.37, 0.05)),
    (pegs, (0.05, 0.05), (0.37, 0.21)),
    (rubble, (0.05, 0.1), (0.45, -0.05)),
    (rubble, (0.45, 0.1), (0.1, 0.12)),
])  # fmt: skip
def test_swings_clear_all_that_stands_about(world, start, end):
    radius, heights = 0.03, ground_of(world)

    def surface(x, y):
        return float(world(np.array([[x]]), np.array([[y]]))[0, 0])

    p0, p1 = (np.array([x, y, surface(x, y) + radius]) for x, y in (start, end))
    spline = SwingSpline(p0, p1, 0.0, 0.4, profile=KnownGround((), heights).profile(p0, p1, radius))
    sphere = np.array([[x, y] for x in np.linspace(-1, 1, 21) for y in np.linspace(-1, 1, 21) if x * x + y * y <= 1.0])
    depth = 0.0
    for point in spline.position(np.linspace(0.02, 0.38, 60)):
        for across in radius * sphere:
            bottom = point[2] - np.sqrt(max(radius**2 - across @ across, 0.0))
            depth = max(depth, surface(*(point[:2] + across)) - bottom)
    assert depth < 0.01
    assert spline.position(np.linspace(0, 0.4, 50))[:, 2].max() < max(p0[2], p1[2]) + 0.25


def test_ground_that_the_map_knows_counts_more_than_planes_of_regions():
    radius, flat = 0.03, ground_of(lambda x, y: 0.0 * x * y)
    slope = square_region([0.0, 0.0, 0.02])  # reaches over the edge of what it stands for
    p0, p1 = np.array([0.0, 0.0, radius]), np.array([0.35, 0.0, radius])
    assert KnownGround((slope,)).profile(p0, p1, radius).max() > radius + 0.01
    np.testing.assert_allclose(KnownGround((slope,), flat).profile(p0, p1, radius), radius, atol=1e-6)
    np.testing.assert_allclose(KnownGround((), GroundHeights.empty()).profile(p0, p1, radius), radius)


def test_an_apex_does_not_rise_for_what_it_cannot_clear():
    """A map that is 1.5 cm too high beside the foot, as a plane that overshoots the end of a ramp is."""
    profile = np.full(25, P0[2])
    profile[1:4] += 0.015
    level = P0 + np.array([0.4, 0.0, 0.0])
    spline = SwingSpline(P0, level, 0.0, 0.4, profile=profile)
    assert spline.apex_height < 0.12
