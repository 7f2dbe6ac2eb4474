"""What the remembered ground believes: noise at edges, labels, several images."""

import dataclasses

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan import view_kernels as views
from quadpips_drake.perception.egocan.egocan import update_memory
from quadpips_drake.perception.egocan.ground_memory import GroundMemoryConfig, scroll_to
from quadpips_drake.values.steppability import Steppability
from tests.perception.scenes import MEDIUM, Scene, affordance, base_pose, camera_mount, look, stepping_stones, walking_poses

CONFIG = PerceptionConfig()
PLACE = (1.0, 0.05)
"""On the floor, in view of a robot at the origin."""


def cell_of(memory, x, y):
    i, j = np.floor(np.array([x, y]) / CONFIG.egocan.ground.cell).astype(int) - memory.ground.first_cell
    assert min(i, j) >= 0, "outside of the window"
    return int(i), int(j)


def noisy(scale, seed=0):
    """Returns a function that spoils depth ``scale`` times as much as a D435 does."""
    rng = np.random.default_rng(seed)

    def spoil(depth):
        sigma = scale * (0.001 + 0.004 * np.where(np.isfinite(depth), depth, 0.0) ** 2)
        depth = depth + (sigma * rng.standard_normal(depth.shape)).astype(np.float32)
        depth[rng.random(depth.shape) < 0.02] = np.nan
        return depth

    return spoil


def show(memory, scene, stamp, label, X_WB=None):
    """Returns ``memory`` after one more image whose pixels all carry ``label``."""
    X_WC = (base_pose() if X_WB is None else X_WB) @ camera_mount()
    labels = np.full((MEDIUM.height, MEDIUM.width), label, np.uint8)
    image = affordance(scene.depth(X_WC, MEDIUM), X_WC, stamp, CONFIG, MEDIUM, labels)
    return update_memory(memory, [image], 0.0, CONFIG.egocan)


def count_stone(memory, scene, trusted_share):
    """Returns how many cells near the robot are believed to be stone although they lie wholly off it, and how many are."""
    config = dataclasses.replace(CONFIG.egocan.ground, trusted_share=trusted_share)
    stone = (memory.ground.trusted_height(config) > -0.02) & (memory.ground.normal[..., 2] > 0.86)
    places = (memory.ground.first_cell + np.argwhere(stone) + 0.5) * config.cell
    places = places[np.hypot(*(places - memory.X_WE[:2, 3]).T) < 0.7]
    distance = scene.edge_distances(places)
    return int((distance < -0.0075).sum()), int((distance > 0.005).sum())


def test_noise_does_not_let_stones_grow_over_many_images():
    scene = stepping_stones(rows=2, columns=3)
    memory = look(scene, walking_poses(0.6, speed=0.6, rate=20.0), CONFIG, noise=noisy(3.0))
    grown, stone = count_stone(memory, scene, CONFIG.egocan.ground.trusted_share)
    grown_unless_missed, stone_unless_missed = count_stone(memory, scene, 0.0)
    assert grown < 0.5 * grown_unless_missed and grown < 0.005 * stone, (grown, grown_unless_missed, stone)
    assert stone > 0.99 * stone_unless_missed


def test_a_missed_surface_is_trusted_again_once_it_is_seen_again():
    floor, hole = Scene([]), Scene([], floor=-0.03)  # too little below for the camera to see through
    memory = look(floor, [(0.1 * k, base_pose(), 0.0) for k in range(4)], CONFIG)
    cell = cell_of(memory, *PLACE)
    believed = []
    for k in range(24):
        memory = show(memory, hole if k < 12 else floor, 1.0 + 0.1 * k, Steppability.UNKNOWN)
        believed.append(float(memory.ground.trusted_height(CONFIG.egocan.ground)[cell]))
    assert believed[0] == pytest.approx(0.0, abs=1e-3), "one image against four"
    assert believed[11] == pytest.approx(-0.03, abs=1e-3)
    assert believed[-1] == pytest.approx(0.0, abs=1e-3)


def test_a_label_stays_with_its_surface_while_images_without_labels_come_in():
    memory = look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG)
    cell = cell_of(memory, *PLACE)
    assert memory.ground.label[cell] == Steppability.UNKNOWN
    memory = show(memory, Scene([]), 0.1, Steppability.PASSABLE)
    assert memory.ground.label[cell] == Steppability.PASSABLE
    for k in range(12):
        memory = show(memory, Scene([]), 0.2 + 0.1 * k, Steppability.UNKNOWN)
    assert memory.ground.label[cell] == Steppability.PASSABLE
    assert memory.ground.label[cell_of(memory, -0.4, 0.0)] == Steppability.UNKNOWN, "assumed, never seen"


def test_newer_labels_win_sooner_the_less_the_old_one_was_confirmed():
    once = show(look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG), Scene([]), 0.1, Steppability.STEPPABLE)
    cell = cell_of(once, *PLACE)
    assert show(once, Scene([]), 0.2, Steppability.NON_PASSABLE).ground.label[cell] == Steppability.NON_PASSABLE
    often = once
    for k in range(20):
        often = show(often, Scene([]), 0.2 + 0.1 * k, Steppability.STEPPABLE)
    seen = []
    for k in range(6):
        often = show(often, Scene([]), 3.0 + 0.1 * k, Steppability.NON_PASSABLE)
        seen.append(int(often.ground.label[cell]))
    assert seen[0] == Steppability.STEPPABLE, "a single contradiction may be an error"
    assert seen[4] == seen[5] == Steppability.NON_PASSABLE


def test_a_new_surface_does_not_inherit_the_label_of_the_old_one():
    memory = show(look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG), Scene([]), 0.1, Steppability.STEPPABLE)
    cell = cell_of(memory, *PLACE)
    box = Scene([[0.8, 1.2, -0.2, 0.2, 0.0, 0.1]])
    raised = show(memory, box, 0.2, Steppability.UNKNOWN)
    assert raised.ground.height[cell] == pytest.approx(0.1, abs=1e-3)
    assert raised.ground.label[cell] == Steppability.UNKNOWN and raised.ground.votes[cell] == 0
    lowered = show(show(raised, box, 0.3, Steppability.PASSABLE), Scene([]), 0.4, Steppability.UNKNOWN)
    assert lowered.ground.height[cell] == pytest.approx(0.0, abs=1e-3)
    assert lowered.ground.label[cell] == Steppability.UNKNOWN


def test_labels_move_with_the_window():
    memory = show(look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG), Scene([]), 0.1, Steppability.PASSABLE)
    moved = scroll_to(memory.ground, np.array([0.73, -0.28, 0.5]), CONFIG.egocan.ground)
    before = cell_of(memory, *PLACE)
    after = tuple(np.array(before) + memory.ground.first_cell - moved.first_cell)
    for name in ("label", "votes", "count", "height"):
        assert getattr(moved, name)[after] == getattr(memory.ground, name)[before] != 0
    far = scroll_to(memory.ground, np.array([50.0, 0.0, 0.5]), CONFIG.egocan.ground)
    assert not far.label.any() and np.isnan(far.height).all()


@pytest.mark.parametrize(
    ("pixels", "expected"),
    [
        ((1.0, 1.0, 1.0, 1.0), views.EXPOSED),
        ((2.0, 2.0, np.inf, np.nan), views.THROUGH),
        ((2.0, 2.0, 1.0, 2.0), views.EXPOSED),
        ((2.0, 0.5, 2.0, 2.0), views.HIDDEN),
        ((2.0, np.nan, np.nan, 0.0), views.HIDDEN),  # too little to judge by
        ((np.nan, np.nan, np.nan, np.nan), views.HIDDEN),
    ],
)
def test_what_four_pixels_say_about_a_point_one_metre_away(pixels, expected):
    depth = np.array(pixels, np.float32).reshape(2, 2)
    camera = np.eye(3), np.zeros(3), np.array([1.0, 1.0, 0.5, 0.5])
    assert views.look_at(0.0, 0.0, 1.0, depth, camera, 0.04) == expected
    assert views.look_at(0.0, 0.0, -1.0, depth, camera, 0.04) == views.HIDDEN, "behind the camera"
    assert views.look_at(3.0, 0.0, 1.0, depth, camera, 0.04) == views.HIDDEN, "out of the image"


@pytest.mark.parametrize("bad", [{"trusted_share": 1.5}, {"cell": 0.0}, {"see_through": 0.0}, {"half_extent": 0.01}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(UserInputError):
        GroundMemoryConfig(**bad)


def test_the_assumption_at_the_start_stays_behind_and_expires():
    """A platform ends 0.3 m behind the robot, where no camera sees; the assumed ground reaches 0.8 m."""
    scene, behind = Scene([[-0.3, 4.0, -1.0, 1.0, -0.4, 0.0]], floor=None), (-0.6, 0.0)
    start = look(scene, [(0.0, base_pose(), 0.0)], CONFIG)
    assert start.ground.height[cell_of(start, *behind)] == pytest.approx(0.0, abs=1e-6), "not true, but assumed"
    ahead = look(scene, [(k, base_pose(x=0.2 * k), 0.0) for k in range(1, 3)], CONFIG, memory=start)
    assert ahead.ground.height[cell_of(ahead, *behind)] == pytest.approx(0.0, abs=1e-6), "it stays where it is in the world"
    away = look(scene, [(5.0 + k, base_pose(x=0.4 + 0.4 * k), 0.0) for k in range(1, 5)], CONFIG, memory=ahead)
    back = look(scene, [(10.0 + k, base_pose(x=2.0 - 0.4 * k), 0.0) for k in range(1, 6)], CONFIG, memory=away)
    assert np.isnan(back.ground.height[cell_of(back, *behind)]), "what left the window is forgotten"
    seen = look(scene, [(k, base_pose(x=-0.2 * k), 0.0) for k in range(1, 9)], CONFIG, memory=start)
    assert np.isnan(seen.ground.height[cell_of(seen, *behind)]), "the camera looks into the void"
