"""The library of terrains, starts and goals."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain import library
from quadpips_drake.terrain.library import load_terrain, terrain_names
from quadpips_drake.terrain.placement import check_start_and_goal, problem_with_goal, problem_with_start
from quadpips_drake.terrain.terrain import Box, Terrain, pose
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.visualization.terrain_picture import save_terrain_picture


@pytest.mark.parametrize("name", terrain_names())
def test_start_and_goal_are_fit_to_walk(name):
    terrain = load_terrain(name)
    check_start_and_goal(terrain)
    assert terrain.name == name
    assert 2.0 <= np.linalg.norm(terrain.goal - terrain.start[:2]) <= 8.51
    # Ground reaches well beyond the goal.
    truth, ahead = GroundTruth(terrain), np.sign(terrain.goal[0] - terrain.start[0])
    assert truth.height(terrain.goal[0] + 0.8 * ahead, terrain.goal[1]) == pytest.approx(
        truth.height(*terrain.goal), abs=5e-3
    )


def test_stepping_stones_have_the_stated_sizes():
    terrain = load_terrain("stepping_stones")
    truth = GroundTruth(terrain)
    x = np.arange(-0.5, 2.0, 0.001) + 5e-4
    ground = ~np.isnan(truth.height(x, 0.2, walkable_only=True))
    edges = x[1:][np.diff(ground.astype(int)) != 0] - 5e-4
    np.testing.assert_allclose(edges, [0.0, 0.2, 0.5, 0.6, 0.9, 1.0, 1.3, 1.5], atol=2e-3)
    assert truth.height(0.1, 0.2) == pytest.approx(-1.0)
    wide = GroundTruth(library.stepping_stones(pit_length=1.7))
    assert wide.distance_to_edge(0.25, 0.2) == pytest.approx(0.15, abs=1e-6)


def test_published_numbers_of_ramp_and_stairs():
    ramp = GroundTruth(load_terrain("ramp_10"))
    assert ramp.height(1.465, 0.0) == pytest.approx(0.571, abs=5e-4)
    assert ramp.height(3.0, 0.0) == pytest.approx(0.572, abs=1e-3)
    assert np.arccos(ramp.normal(0.0, 0.0)[2]) == pytest.approx(0.175)
    stairs = GroundTruth(load_terrain("stairs"))
    np.testing.assert_allclose(stairs.height(0.2 * np.arange(10), 0.0), 0.05 * np.arange(1, 11), atol=1e-12)
    assert stairs.height(1.95, 0.0) == pytest.approx(0.525)


def test_slope_and_bumps():
    slope = GroundTruth(load_terrain("slope"))
    run = 3.0 * np.cos(0.2618)
    assert slope.height(1.0, 0.0) == pytest.approx(np.tan(0.2618), abs=1e-6)
    assert slope.height(run + 0.7, 0.0) == pytest.approx(3.0 * np.sin(0.2618), abs=1e-6)
    assert slope.height(2 * run + 2.0 - 1.0, 0.0) == pytest.approx(np.tan(0.2618), abs=1e-6)
    assert np.arccos(slope.normal(1.0, 0.5)[2]) == pytest.approx(0.2618)
    bumps = GroundTruth(load_terrain("bumps", seed=2))
    x, y = np.meshgrid(np.arange(0.125, 3.5, 0.25), np.arange(-1.375, 1.5, 0.25))
    tops = bumps.height(x.ravel(), y.ravel())
    assert np.abs(tops).max() <= 0.03
    assert np.ptp(tops) > 0.05
    with pytest.raises(UserInputError):
        library.bumps(height=-0.1)
    with pytest.raises(UserInputError):
        library.slope(angle=0.0)


def test_sparse_stones_follow_the_seed():
    def places(seed):
        return {tuple(element.X_WE[:2, 3].round(6)) for element in load_terrain("sparse_stones", seed=seed).elements}

    assert places(3) == places(3)
    assert places(3) != places(4)
    counts = [len(places(seed)) - 3 for seed in range(20)]
    assert abs(np.mean(counts) - 160) < 10


def test_start_over_the_pit_and_goal_off_the_terrain_are_refused():
    in_pit = load_terrain("stepping_stones", start=(0.1, 1.9, 0.0))
    assert "pit_floor" in problem_with_start(in_pit)
    off = load_terrain("flat", goal=(50.0, 0.0))
    assert "off the terrain" in problem_with_goal(off)
    with pytest.raises(UserInputError, match="off the terrain"):
        check_start_and_goal(off)
    # A foot beside the edge counts, not only the base.
    edge = load_terrain("stepping_stones", start=(-0.3, 0.8, 0.0))
    assert problem_with_start(edge) is not None
    cliff = Terrain("cliff", (0, 0, 0), (1, 0), 1.0, tuple(
        Box(size=(2, 4, 0.1), X_WE=pose((side, 0, -0.3 * (side > 0)))) for side in (-1, 1)))  # fmt: skip
    assert "differs by 0.30 m" in problem_with_start(cliff)


def test_unknown_names_list_the_known_ones():
    with pytest.raises(UserInputError, match="known: balance_beam, boulders, bumps, down_ramp, flat, gap, "):
        load_terrain("moon")
    with pytest.raises(UserInputError, match=r"must end in \.yaml"):
        load_terrain("moon.txt")
    for bad in ({"stone_size": -1.0}, {"pit_length": 0.2}):
        with pytest.raises(UserInputError):
            library.stepping_stones(**bad)


def test_picture_is_written(tmp_path):
    save_terrain_picture(load_terrain("stairs"), tmp_path / "stairs.png")
    assert (tmp_path / "stairs.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(UserInputError, match=r"\.png"):
        save_terrain_picture(load_terrain("flat"), tmp_path / "flat.what")
    with pytest.raises(UserInputError, match="cannot write"):
        save_terrain_picture(load_terrain("flat"), tmp_path / "missing" / "flat.png")
