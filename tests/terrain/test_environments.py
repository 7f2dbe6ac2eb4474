"""The environments: published dimensions, starts and goals, what the seed and the difficulty change."""

import hashlib
import itertools
import math

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain, terrain_difficulty, terrain_names
from quadpips_drake.terrain.placement import problem_with_goal, problem_with_start
from quadpips_drake.terrain.suites import suite_names, suite_terrains
from quadpips_drake.terrain.terrain import Box, Cylinder, Sphere, Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.simulated_trial import SimulationConfig
from quadpips_drake.values.steppability import Steppability

EARLIER = {
    "bumps": "cd4595de4326add38023f425ec15d5027a1219e5dee85504e0c37fbb92a365a2",
    "flat": "6f275552cfce8663e4277902f66f191081ff17860b88e6e087261b06f6765241",
    "ramp_10": "3b78e3b081b76faeb45aafc48b60dc98169091e9643a56c1ed34714961e00df3",
    "slope": "9863fa368737b28ec7698c529f530590b38492fd49b7f6104f9fc550ee2d54b9",
    "sparse_stones": "9db5c237f71aa388a518a20cac33a96c3f977950ebd9b85109fade5a56ce3539",
    "stairs": "d8d30e3d3f67b1d720c7ea1bc550742003c06f1177f5b7d0abcc38ae724d02c8",
    "stepping_stones": "c318d9e2dad0bb62394dddb02b010cd7dafc93b6c5ac1b1d09b99eb0a739ff83",
}
"""SHA-256 of the terrains with seeds 0 to 2 as they were before there were environments, to 12 decimals."""
RANDOM = {"boulders", "bumps", "irregular_stones", "pegboard", "rubble", "sparse_stones"}
UNITS = {"m", "rad", "1"}


def fingerprint(terrain: Terrain) -> bytes:
    """All that a terrain is, as bytes; 12 decimals, because the last bit of a sine is another on another processor."""
    text = [terrain.name, *(np.round(value, 12) + 0.0 for value in (terrain.start, terrain.goal, terrain.friction))]
    for element in terrain.elements:
        sizes = element.size if isinstance(element, Box) else (element.radius, getattr(element, "length", 0.0))
        text += [element.name, int(element.label), np.round(sizes, 12) + 0.0, np.round(element.X_WE, 12) + 0.0]
    return "\n".join(str(item.tolist() if isinstance(item, np.ndarray) else item) for item in text).encode()


def element(terrain: Terrain, name: str):
    return next(item for item in terrain.elements if item.name == name)


def top_line(box: Box) -> np.ndarray:
    """x and z of the ends of a plate's upper face, in the middle of its width, (2, 2)."""
    length, _, height = box.size
    ends = [[0.5 * length, 0, 0.5 * height, 1], [-0.5 * length, 0, 0.5 * height, 1]]
    return (box.X_WE @ np.transpose(ends))[[0, 2]].T


@pytest.mark.parametrize("name", EARLIER)
def test_earlier_terrains_are_what_they_were(name):
    whole = b"\n".join(fingerprint(load_terrain(name, seed=seed)) for seed in range(3))
    assert hashlib.sha256(whole).hexdigest() == EARLIER[name]


@pytest.mark.parametrize("name", terrain_names())
def test_the_seed_alone_decides(name):
    assert fingerprint(load_terrain(name, seed=3)) == fingerprint(load_terrain(name, seed=3))
    assert (fingerprint(load_terrain(name, seed=3)) != fingerprint(load_terrain(name, seed=4))) == (name in RANDOM)


@pytest.mark.parametrize("robot", ["anymal_c", "go2"])
def test_starts_leave_room_for_what_the_seed_changes(robot):
    """Wherever the seed moves the start, all four feet of the nominal stance find ground of one height."""
    config = SimulationConfig()
    reach = np.array([config.start_position_noise, config.start_position_noise, config.start_yaw_noise])
    feet = load_robot(robot).nominal_footholds_B[:, :2]
    for name in terrain_names():
        terrain = load_terrain(name, seed=1)
        for signs in itertools.product((-1, 0, 1), repeat=3):
            moved = Terrain(name, terrain.start + reach * signs, terrain.goal, terrain.friction, terrain.elements)
            assert problem_with_start(moved, feet, max_step=1e-6) is None


def test_ramps_as_published():
    down = load_terrain("down_ramp")
    np.testing.assert_allclose(element(down, "ramp").X_WE[:3, 3], [3, 0, -0.70245], atol=1e-4)
    np.testing.assert_allclose(element(down, "lower_platform").X_WE[:3, 3], [5.85067, 0, -1.35490], atol=1e-4)
    gentle = load_terrain("down_ramp", difficulty=0.175)
    np.testing.assert_allclose(element(gentle, "ramp").X_WE[:3, 3], [3, 0, -0.31116], atol=1e-4)
    np.testing.assert_allclose(element(gentle, "lower_platform").X_WE[:3, 3], [5.97709, 0, -0.57232], atol=1e-4)
    assert down.start.tolist() == [-0.7, 0, 0] and down.goal.tolist() == [6.5, 0]


def test_stairs_as_published():
    truth = GroundTruth(load_terrain("stairs_10"))
    np.testing.assert_allclose(truth.height(0.2 * np.arange(10), 0.0), 0.1 * np.arange(1, 11), atol=1e-12)
    assert truth.height(2.0, 0.0) == pytest.approx(1.05)
    for name in ("stairs", "stairs_10"):
        closed, opened = load_terrain(name), load_terrain(f"open_{name}")
        x = np.linspace(-1.0, 3.0, 81) + 1e-3
        np.testing.assert_allclose(GroundTruth(opened).height(x, 0.3), GroundTruth(closed).height(x, 0.3), atol=1e-12)
        low, high = (element(opened, f"tread_{k}").bounds() for k in (0, 1))
        assert high[0][2] - low[1][2] > 0.5 * element(closed, "tread_0").size[2], "a gap between treads"
        low, high = (element(closed, f"tread_{k}").bounds() for k in (0, 1))
        assert high[0][2] == pytest.approx(low[1][2]), "no gap"


def test_fields_as_published():
    pegboard, rubble = load_terrain("pegboard", seed=5), load_terrain("rubble", seed=5)
    ridge = np.array([0.05, 0.10, 0.15, 0.20, 0.25, 0.30, 0.25, 0.20, 0.15, 0.10])
    x, y = np.meshgrid(0.3 * np.arange(10), 0.3 * np.arange(10))
    more = GroundTruth(pegboard).height(x, y) - ridge
    assert 0.0 <= more.min() < 0.005 and 0.07 < more.max() < 0.075 and more.mean() == pytest.approx(0.0375, abs=0.005)
    boxes = rubble.elements[1:]
    assert len(boxes) == 100
    sizes, centers = np.array([box.size for box in boxes]), np.array([box.X_WE[:3, 3] for box in boxes])
    assert 0.30 <= sizes[:, :2].min() < 0.305 and 0.445 < sizes[:, :2].max() <= 0.45 and set(sizes[:, 2]) == {0.1}
    rpy = np.array([box.rpy for box in boxes])
    assert ((np.abs(rpy).max(axis=0) > 0.23) & (np.abs(rpy).max(axis=0) <= 0.25)).all()
    grid = np.column_stack((x.ravel(), y.ravel()))
    assert 0.025 < np.abs(centers[:, :2] - grid).max() <= 0.03 and (centers[:, 2] == 0).all()
    for terrain in (pegboard, rubble):
        assert terrain.start.tolist() == [-2.5, 1.4, 0] and terrain.goal.tolist() == [3.5, 1.4]


def test_beams_as_published():
    def spans(terrain: Terrain, x: float) -> np.ndarray:
        """Where ground along y begins and ends at x."""
        y = np.arange(-1.5, 1.5, 0.001) + 5e-4
        ground = ~np.isnan(GroundTruth(terrain).height(x, y, walkable_only=True))
        return y[1:][np.diff(ground.astype(int)) != 0] - 5e-4

    beam = load_terrain("balance_beam")
    for x in (-0.99, 0.0, 0.99):
        np.testing.assert_allclose(spans(beam, x), [-0.25, 0.25], atol=2e-3)
    assert len(spans(beam, -1.01)) == len(spans(beam, 1.01)) == 0, "platforms begin at 1 m"
    assert GroundTruth(beam).height(0.0, 0.6) == pytest.approx(-0.95)
    assert beam.start.tolist() == [-3, 0, 0] and beam.goal.tolist() == [2, 0]
    offset = load_terrain("offset_beam")
    assert offset.start.tolist() == [-3, 0.75, 0] and offset.goal.tolist() == [2, 0.75]
    np.testing.assert_allclose(spans(offset, 0.0), [-0.25, 0.25], atol=2e-3)
    np.testing.assert_allclose(spans(load_terrain("parallel_beams"), 0.3), [-0.525, -0.325, 0.325, 0.525], atol=2e-3)


def test_barriers_stand_on_the_beam_and_are_passable():
    terrain = load_terrain("obstructed_balance_beam")
    barriers = [item for item in terrain.elements if item.label == Steppability.PASSABLE]
    assert [item.name for item in barriers] == ["barrier_0", "barrier_1", "barrier_2"]
    truth = GroundTruth(terrain)
    for k, barrier in enumerate(barriers):
        x, side = barrier.X_WE[0, 3], 1 if k % 2 == 0 else -1
        heights = truth.height(x, side * np.array([-0.2499, 0.0, 0.2499]))
        np.testing.assert_allclose(heights, [0.0, 0.06, 0.12], atol=1e-3)
        assert barrier.bounds()[1][2] == pytest.approx(0.12, abs=1e-9)
        assert barrier.bounds()[0][2] < 1e-9 + 0.12 * (1 - math.cos(math.atan2(0.12, 0.5))), "nothing is open below"
        # An opening of more than a foot's length before and behind it.
        for ahead in (-0.1, 0.1):
            assert truth.label(x + ahead, 0.0) == Steppability.STEPPABLE and truth.height(x + ahead, 0.0) == 0.0


@pytest.mark.parametrize("name", ["winding_balance_beam", "winding_balance_beam_hard"])
def test_the_straight_line_leaves_a_winding_beam(name):
    terrain = load_terrain(name)
    truth, line = GroundTruth(terrain), np.linspace(terrain.start[:2], terrain.goal, 400)
    ground = ~np.isnan(truth.height(*line.T, walkable_only=True))
    assert ground[[0, -1]].all() and (~ground).mean() > 0.2
    # Along the beam there is ground of one height, 0.5 m wide, also around the bends.
    corners = {
        "winding_balance_beam": [(-0.5, 0), (0.6, 0), (1.4, 0.6), (2.2, 0.6), (3.0, 0), (4.0, 0)],
        "winding_balance_beam_hard": [(-0.5, 0), (1.2, 0), (1.2, 2.2), (3.0, 2.2)],
    }[name]
    bends = 0
    for a, b in itertools.pairwise(np.array(corners, float)):
        along = (b - a) / np.linalg.norm(b - a)
        points = a + np.linspace(0, 1, 50)[:, None] * (b - a)
        for side in (-0.249, 0.0, 0.249):
            np.testing.assert_array_equal(truth.height(*(points + side * np.array([-along[1], along[0]])).T), 0.0)
        bends += 1
    assert bends - 1 >= 2
    if name.endswith("hard"):
        assert terrain.goal[1] - terrain.start[1] == pytest.approx(2.2)
        assert np.isnan(truth.height(0.5, 1.0, walkable_only=True)), "no short cut"


def test_ramped_beam_as_published():
    terrain = load_terrain("ramped_balance_beam")
    lines = {
        "up": ((-1.017, -0.194), (-2.970, 0.227)),
        "divot": ((-2.992, 0.226), (-3.603, -0.147)),
        "up_again": ((-3.211, 0.326), (-3.862, 0.466)),
        "platform": ((-3.863, 0.467), (-4.529, 0.455)),
        "beam": ((-4.505, 0.455), (-5.892, 0.432)),
        "far_platform": ((-5.880, 0.432), (-6.546, 0.421)),
        "down": ((-6.544, 0.421), (-8.358, -0.417)),
    }
    for name, line in lines.items():
        np.testing.assert_allclose(top_line(element(terrain, name)), line, atol=2e-3, err_msg=name)
    np.testing.assert_allclose(element(terrain, "beam").size[:2], [1.387, 0.374])
    truth = GroundTruth(terrain)
    assert truth.height(-3.1, 0.5) == pytest.approx(0.16, abs=0.02), "the divot"
    assert truth.height(-3.25, 0.5) == pytest.approx(0.335, abs=0.01), "behind it"
    assert truth.height(-5.2, 0.8) == pytest.approx(-0.95)
    easy = load_terrain("ramped_balance_beam_easy")
    changed = [a.name for a, b in zip(terrain.elements, easy.elements, strict=True) if (a.X_WE != b.X_WE).any()]
    assert changed == ["down"]
    assert math.acos(GroundTruth(easy).normal(-7.0, 0.4)[2]) == pytest.approx(0.2126, abs=1e-6)
    assert terrain.start.tolist() == [0, 0.5, -math.pi] and terrain.goal.tolist() == [-8.5, 0.5]


def test_ramped_stones_as_published():
    terrain = load_terrain("ramped_stepping_stones")
    stones = [item for item in terrain.elements if isinstance(item, Cylinder)]
    assert len(stones) == 21 and {(s.radius, s.length) for s in stones} == {(0.1115, 1.0)}
    tops = np.array([s.X_WE[:3, 3] + 0.5 * s.X_WE[:3, 2] for s in stones])
    np.testing.assert_allclose(tops[0], [-4.578, 7.706, 0.252], atol=1e-9)
    np.testing.assert_allclose(tops[:, 2], 0.252, atol=1e-9)
    np.testing.assert_allclose([math.degrees(math.acos(s.X_WE[2, 2])) for s in stones], 1.47, atol=1e-6)
    np.testing.assert_allclose(top_line(element(terrain, "up")), [(-1.734, -0.194), (-3.687, 0.227)], atol=2e-3)
    np.testing.assert_allclose(top_line(element(terrain, "platform")), [(-3.687, 0.227), (-4.353, 0.216)], atol=2e-3)
    np.testing.assert_allclose(top_line(element(terrain, "far_platform")), [(-6.038, 0.257), (-6.704, 0.246)], atol=2e-3)
    truth = GroundTruth(terrain)
    assert truth.height(-4.45, 7.6) == pytest.approx(-0.7)
    assert math.degrees(math.acos(truth.normal(-6.9, 7.4)[2])) == pytest.approx(28.2, abs=0.1)
    assert terrain.start.tolist() == [0.5, 7.5, -math.pi] and terrain.goal.tolist() == [-8, 7.5]


def test_boulders_lie_on_the_ground_and_are_labelled_by_height():
    terrain = load_terrain("boulders", seed=2)
    spheres = terrain.elements[1:]
    assert 14 <= len(spheres) <= 20 and {type(sphere) for sphere in spheres} == {Sphere}
    centers, radii = np.array([s.X_WE[:3, 3] for s in spheres]), np.array([s.radius for s in spheres])
    np.testing.assert_array_equal(centers[:, 2], radii)
    np.testing.assert_allclose(GroundTruth(terrain).height(*centers[:, :2].T), 2 * radii)
    between = np.linalg.norm(centers[:, None] - centers, axis=2) - radii - radii[:, None]
    assert between[~np.eye(len(radii), dtype=bool)].min() >= 0.05
    labels = {2 * s.radius > 0.15: s.label for s in spheres}
    assert labels == {False: Steppability.PASSABLE, True: Steppability.NON_PASSABLE}


def test_what_the_go2_walked_over():
    def heights(name: str, x) -> np.ndarray:
        return GroundTruth(load_terrain(name)).height(np.array(x), 0.2)

    np.testing.assert_allclose(heights("go2_single_platform", [-0.1, 0.1, 1.1, 1.3]), [0, 0.12, 0.12, 0])
    np.testing.assert_allclose(
        heights("go2_double_platform", [-0.1, 0.1, 1.1, 1.3, 2.1, 2.3]), [0, 0.12, 0.12, 0.05, 0.05, 0]
    )
    run = 0.12 / math.tan(math.radians(10))
    x = [0.5 * run, run - 1e-6, run + 0.5, run + 1.2 + 0.5 * run, 2 * run + 1.3]
    np.testing.assert_allclose(heights("go2_ramped_platform", x), [0.06, 0.12, 0.12, 0.06, 0], atol=1e-6)
    x = [0.5 * run, run + 0.1, run + 0.9, run + 1.7, run + 2.8]
    np.testing.assert_allclose(heights("go2_triple_platform", x), [0.06, 0.12, 0.25, 0.35, 0.35], atol=1e-9)
    terrain = load_terrain("go2_ramped_stones")
    stones = [element(terrain, f"stone_{row}_{column}") for row in range(2) for column in range(2)]
    centers = np.array([stone.X_WE[:2, 3] for stone in stones])
    np.testing.assert_allclose(centers - centers[0], [(0, 0), (0, 0.4), (0.4, 0), (0.4, 0.4)], atol=1e-12)
    assert {tuple(stone.size) for stone in stones} == {(0.2, 0.2, 0.12)}
    edges = element(terrain, "platform").bounds()[1][0], element(terrain, "far_platform").bounds()[0][0]
    np.testing.assert_allclose([centers[0, 0] - 0.1 - edges[0], edges[1] - centers[2, 0] - 0.1], 0.2, atol=1e-12)


@pytest.mark.parametrize("name", [name for name in terrain_names() if terrain_difficulty(name)])
def test_difficulty_changes_the_world_within_its_range(name):
    kind, plain = terrain_difficulty(name), load_terrain(name)
    assert kind.unit in UNITS and kind.low < kind.default < kind.high
    assert fingerprint(load_terrain(name, difficulty=kind.default)) == fingerprint(plain)
    for value in (kind.low, kind.high):
        other = load_terrain(name, difficulty=value)
        assert fingerprint(other) != fingerprint(plain) and other.name == name
        assert problem_with_goal(other) is None and problem_with_start(other) is None
    for value in (kind.low - 0.01, kind.high + 0.01, math.nan):
        with pytest.raises(UserInputError, match=f"'{name}': its {kind.title} must be"):
            load_terrain(name, difficulty=value)


def test_difficulty_is_what_it_says():
    def widest_hole(name: str, difficulty: float) -> float:
        x = np.arange(-1.0, 3.0, 0.001)
        walkable = x[~np.isnan(GroundTruth(load_terrain(name, difficulty=difficulty)).height(x, 0.15, walkable_only=True))]
        return np.diff(walkable).max()

    for value in (0.1, 0.35):
        assert widest_hole("gap", value) == pytest.approx(value, abs=2e-3)
        for name, x in (("ramp_10", 0.0), ("slope", 1.0), ("down_ramp", 3.0)):
            assert math.acos(GroundTruth(load_terrain(name, difficulty=value)).normal(x, 0.0)[2]) == pytest.approx(value)
    stairs = GroundTruth(load_terrain("stairs", difficulty=0.17))
    assert stairs.height(0.8, 0.0) - stairs.height(0.6, 0.0) == pytest.approx(0.17)
    stones = load_terrain("stepping_stones", difficulty=0.25)
    assert element(stones, "stone_0_1").bounds()[0][1] - element(stones, "stone_0_0").bounds()[1][1] == pytest.approx(0.25)
    assert len(load_terrain("sparse_stones", difficulty=1.0).elements) == 403
    few, many = (load_terrain("sparse_stones", seed=2, difficulty=p).elements for p in (0.2, 0.5))
    assert {stone.name for stone in few} < {stone.name for stone in many}, "the same draws"
    tilts = [np.abs([box.rpy[:2] for box in load_terrain("rubble", difficulty=t).elements]).max() for t in (0.1, 0.5)]
    assert tilts == [pytest.approx(0.1, abs=0.01), pytest.approx(0.5, abs=0.03)]
    for name in ("balance_beam", "ramped_balance_beam"):
        assert element(load_terrain(name, difficulty=0.25), "beam").size[1] == 0.25


def test_gaps_and_steps_as_published():
    def holes(name: str, y: float, **options) -> list[tuple[float, float]]:
        """Where gaps begin and end at y."""
        x = np.arange(-1.5, 3.6, 0.001) + 5e-4
        ground = ~np.isnan(GroundTruth(load_terrain(name, **options)).height(x, y, walkable_only=True))
        ends = x[1:][np.diff(ground.astype(int)) != 0] - 5e-4
        return [(begin, end) for begin, end in ends.reshape(-1, 2)]

    for y in (-0.2, 0.2):
        np.testing.assert_allclose(holes("gaps_symmetric", y), [(0, 0.10), (1.05, 1.20)], atol=2e-3)
    np.testing.assert_allclose(holes("gaps_staggered", 0.2), [(0, 0.15), (1.40, 1.55)], atol=2e-3)
    np.testing.assert_allclose(holes("gaps_staggered", -0.2), [(0.30, 0.45), (1.70, 1.85)], atol=2e-3)
    np.testing.assert_allclose(holes("gaps_and_steps", 0.2), [(0, 0.10), (1.05, 1.17), (2.42, 2.55)], atol=2e-3)
    np.testing.assert_allclose(holes("gaps_and_steps", -0.2), [(0, 0.10), (1.35, 1.47), (2.72, 2.85)], atol=2e-3)
    np.testing.assert_allclose(holes("gaps_symmetric", 0.2, difficulty=2.0), [(0, 0.20), (1.15, 1.45)], atol=2e-3)
    staggered, steps = (GroundTruth(load_terrain(name)) for name in ("gaps_staggered", "gaps_and_steps"))
    np.testing.assert_allclose(staggered.height([2.7, 2.9], 0.2), [0, 0.06], atol=1e-9)
    np.testing.assert_allclose(steps.height([3.7, 3.9, 4.7, 4.9], -0.2), [0, 0.06, 0.06, 0], atol=1e-9)
    assert staggered.height(0.07, 0.2) == pytest.approx(-0.5)
    assert np.isnan(staggered.height(0.07, 0.2, walkable_only=True))


def test_spheres_leave_no_room_on_their_stones():
    robot = load_robot("anymal_c")
    for seed in range(3):
        terrain = load_terrain("irregular_stones", seed=seed, difficulty=0.5)
        spheres = [item for item in terrain.elements if isinstance(item, Sphere)]
        assert len(spheres) >= 2 and {int(sphere.name.split("_")[1]) % 2 for sphere in spheres} == {0}
        for row in (0, 2):  # one of the two beside the straight way
            assert sum(sphere.name in (f"sphere_{row}_3", f"sphere_{row}_4") for sphere in spheres) == 1
        for sphere in spheres:
            stone = element(terrain, sphere.name.replace("sphere", "stone"))
            half = 0.5 * stone.size[0] - robot.foot_radius - 0.015
            corners = np.array([[x, y, 0.5 * stone.size[2], 1.0] for x in (-half, half) for y in (-half, half)])
            feet = (corners + np.array([0.0, 0.0, robot.foot_radius, 0.0])) @ stone.X_WE.T
            assert np.linalg.norm(feet[:, :3] - sphere.X_WE[:3, 3], axis=1).max() < sphere.radius + robot.foot_radius
            assert 2.0 * sphere.radius > 0.10 and sphere.label == Steppability.NON_PASSABLE


def test_what_has_no_difficulty_says_so(tmp_path):
    with pytest.raises(UserInputError, match="terrain 'flat' has no difficulty"):
        load_terrain("flat", difficulty=0.5)
    with pytest.raises(UserInputError, match="a terrain file has none"):
        load_terrain(str(tmp_path / "course.yaml"), difficulty=0.5)


def test_suites_name_terrains_that_there_are():
    for suite, robot in itertools.product(suite_names(), ("anymal_c", "go2", "long_dog")):
        members = suite_terrains(suite, robot)
        assert len(set(members)) == len(members) and set(members) <= set(terrain_names())
    assert len(suite_terrains("paper", "anymal_c")) == 10
    assert set(suite_terrains("paper", "anymal_c")) ^ set(suite_terrains("paper", "go2")) == {"stairs", "stairs_10"}
    assert "stairs_10" in suite_terrains("paper", "anymal_c")
    assert len(suite_terrains("go2_hardware", "go2")) == 6
    assert set(suite_terrains("paper", "go2")) | set(suite_terrains("go2_hardware", "go2")) <= set(
        suite_terrains("all", "go2")
    )
    assert not any(name.startswith("go2_") for name in suite_terrains("all", "anymal_c"))
    with pytest.raises(UserInputError, match="unknown suite 'papers'"):
        suite_terrains("papers", "go2")
