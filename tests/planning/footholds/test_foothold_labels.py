"""Labels of footholds: what a foothold costs, and where the search steps because of it."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_labels import foothold_labels, foothold_units
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.footholds.stance_transitions import cost_rate
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.regions import PlanarRegion, RegionSet
from quadpips_drake.values.sensing import CameraIntrinsics
from quadpips_drake.values.steppability import Steppability
from tests.planning import worlds
from tests.planning.label_images import from_above
from tests.planning.probe import planning_config

ROBOT = load_robot("anymal_c")
PENALTY = FootholdConfig(steppability="penalty")
UNKNOWN, STEPPABLE, PASSABLE, NON_PASSABLE = Steppability
R = 0.03
UP = np.array([[0.0, 0.0, 1.0]])


def labelled(regions, label_at) -> RegionSet:
    """The regions with the labels at their centres."""
    return RegionSet(
        0.0, tuple(PlanarRegion(r.id, r.X_WR, r.boundary, r.inset, int(label_at(*r.center[:2]))) for r in regions.regions)
    )


def units_at(config, image, x, y, label=UNKNOWN, z=0.0):
    mask = foothold_labels(config, [worlds.patch(0, 0, 0, 1, 1, label=label)], image)
    return foothold_units(np.array([[x, y, z]]), UP, np.zeros(1, int), 0, R, mask)


def plan_along_x(regions, config, image=None, goal=(2.3, 0.0)):
    state = worlds.standing_state(ROBOT)
    path = search_torso_path(
        state.p_WB, 0.0, regions, goal, ROBOT, TorsoConfig(), request_id=1, every_label=config.every_label
    )
    return search_footholds(state, regions, path, ROBOT, config, labels=image)


def labels_of(plan):
    """Those of the regions that a swing led to."""
    pairs = zip(plan.swing_legs, plan.stances[1:], strict=True)
    return [stance.regions[leg].label for legs, stance in pairs for leg in legs]


def footholds_of(plan):
    """Those that a swing led to, (n, 3)."""
    pairs = zip(plan.swing_legs, plan.stances[1:], strict=True)
    return np.array([stance.footholds[leg] for legs, stance in pairs for leg in legs])


def test_points_cost_1_5_100_1000():
    image = from_above(lambda x, y: np.select([x < 0.0, x < 1.0], [STEPPABLE, PASSABLE], NON_PASSABLE), y_range=(-1, 1))
    assert units_at(PENALTY, image, -0.5, 0.0) == 5 * 1
    assert units_at(PENALTY, image, 0.5, 0.0) == 5 * 100
    assert units_at(PENALTY, image, 1.5, 0.0) == 5 * 1000
    assert units_at(PENALTY, image, 0.0, 3.0) == 5 * 5
    assert units_at(PENALTY, image, -0.02, 0.0) == 4 * 1 + 100, "the point ahead lies beyond the border"
    assert units_at(PENALTY, image, 1.02, 0.0) == 4 * 1000 + 100, "the point behind lies before the border"
    assert units_at(PENALTY, image, -0.5, 0.99) == 4 * 1 + 5, "the point to the left is out of the frame"
    assert units_at(PENALTY, image, 0.0, 0.0, z=21.0) == 5 * 5, "behind the camera"


def test_points_beside_the_centre_lie_on_the_plane():
    # Seen from the side, along y, a foothold on a slope that rises with x has its points at other heights.
    X_WC = np.eye(4)
    X_WC[:3, :3], X_WC[:3, 3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]), [0.0, -1.0, 0.0]
    labels = np.full((101, 101), STEPPABLE, np.uint8)
    labels[:48] = NON_PASSABLE  # above 0.025 m
    image = LabelImage(0.0, labels, None, X_WC, CameraIntrinsics(101, 101, 100.0, 100.0, 50.0, 50.0))
    mask = foothold_labels(PENALTY, [worlds.patch(0, 0, 0, 1, 1)], image)
    point, region, slope = np.zeros((1, 3)), np.zeros(1, int), np.array([[-np.sin(0.785), 0.0, np.cos(0.785)]])
    assert foothold_units(point, UP, region, 0, 0.05, mask) == 5
    assert foothold_units(point, slope, region, 0, 0.05, mask) == 4 + 1000


def test_unknown_labels_count_as_configured():
    image = from_above(lambda x, y: np.where(x < 0.0, UNKNOWN, 250))
    assert units_at(PENALTY, image, -0.5, 0.0) == units_at(PENALTY, image, 0.5, 0.0) == 25
    strict = replace(PENALTY, steppability_unknown="non_passable")
    assert units_at(strict, image, -0.5, 0.0) == 5000
    assert units_at(strict, None, 0.0, 0.0, label=UNKNOWN) == 5000
    trusting = replace(PENALTY, steppability_unseen="region")
    assert units_at(trusting, image, -0.5, 0.0, label=PASSABLE) == 500


def test_what_hides_a_foothold_gives_it_its_label_or_none():
    image = from_above(lambda x, y: NON_PASSABLE)
    hidden = replace(image, depth=image.depth - 0.3)
    seen = replace(image, depth=image.depth - 0.04)
    option = replace(PENALTY, steppability_occluded="out_of_frame")
    assert units_at(PENALTY, hidden, 0.0, 0.0) == 5000
    assert units_at(option, hidden, 0.0, 0.0) == 25
    assert units_at(option, seen, 0.0, 0.0) == 5000
    for nothing in (0.0, np.nan, np.inf):
        assert units_at(option, replace(image, depth=np.full_like(image.depth, nothing)), 0.0, 0.0) == 5000
    assert units_at(option, replace(image, depth=None), 0.0, 0.0) == 5000


NOWHERE = replace(from_above(lambda x, y: 1), X_WC=np.full((4, 4), np.nan))


@pytest.mark.parametrize("image", [None, LabelImage.empty(), NOWHERE])
def test_without_an_image_regions_have_exact_labels(image):
    for label, units in ((UNKNOWN, 25), (STEPPABLE, 5), (PASSABLE, 500), (NON_PASSABLE, 5000)):
        assert units_at(PENALTY, image, 0.0, 0.0, label) == units


def test_out_of_the_frame_the_region_counts_if_asked_for():
    image, option = from_above(lambda x, y: STEPPABLE), replace(PENALTY, steppability_unseen="region")
    assert units_at(PENALTY, image, 9.0, 0.0, NON_PASSABLE) == 25
    assert units_at(option, image, 9.0, 0.0, NON_PASSABLE) == 5000
    assert units_at(option, image, 0.0, 0.0, NON_PASSABLE) == 5


def test_kernel_agrees_with_a_plain_projection():
    rng, k = np.random.default_rng(0), CameraIntrinsics(64, 48, 40.0, 42.0, 30.0, 25.0)
    labels = rng.integers(0, 4, (48, 64)).astype(np.uint8)
    depth = rng.uniform(0.5, 2.0, (48, 64)).astype(np.float32)
    config = replace(PENALTY, steppability_occluded="out_of_frame", steppability_unseen="region")
    table, by_region, counts = {0: None, 1: 1.0, 2: 100.0, 3: 1000.0}, np.array([5.0, 1.0, 100.0, 1000.0]), np.zeros(2, int)
    for _ in range(40):
        X_WC = np.eye(4)
        X_WC[:3, :3], X_WC[:3, 3] = rotation_from_rpy(rng.uniform(-3, 3, 3)), rng.uniform(-1, 1, 3)
        mask = foothold_labels(
            config, [worlds.patch(n, 0, 0, 1, 1, label=n) for n in range(4)], LabelImage(0.0, labels, depth, X_WC, k)
        )
        points = rng.uniform([-1.0, -1.0, -0.2], [1.0, 1.0, 2.0], (30, 3)) @ X_WC[:3, :3].T + X_WC[:3, 3]
        normals = np.column_stack([rng.uniform(-0.4, 0.4, (30, 2)), np.ones(30)])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        regions = rng.integers(0, 4, 30)
        for n, (p, normal, region) in enumerate(zip(points, normals, regions, strict=True)):
            expected = 0.0
            for dx, dy in ((0, 0), (R, 0), (-R, 0), (0, R), (0, -R)):
                q = p + np.array([dx, dy, -(normal[0] * dx + normal[1] * dy) / normal[2]])
                x, y, z = X_WC[:3, :3].T @ (q - X_WC[:3, 3])
                u, v = np.floor([k.fx * x / z + k.cx + 0.5, k.fy * y / z + k.cy + 0.5])
                value = None
                if z > 1e-3 and 0 <= u < 64 and 0 <= v < 48 and z <= depth[int(v), int(u)] + 0.05:
                    value = table[labels[int(v), int(u)]]
                counts[int(value is not None)] += 1
                expected += by_region[region] if value is None else value
            assert foothold_units(points, normals, regions, n, R, mask) == expected
    assert counts.min() > 300


@pytest.mark.parametrize("robot", ["anymal_c", "go2"])
def test_a_non_passable_foot_costs_more_than_the_longest_plan(robot):
    """As the search sees it: the inflated way along all of the local path, a half turn included."""
    config = planning_config(robot).footholds
    longest = config.heuristic_inflation * cost_rate(config) * (config.local_radius + np.pi * config.yaw_weight)
    assert 5 * (1000 - 1) * config.steppability_weight > longest


def test_footholds_keep_off_what_the_image_shows_and_no_region_knows():
    """Something small lies wherever the blind plan steps, and the regions know nothing of it."""
    regions = worlds.flat_ground()
    blind = plan_along_x(regions, FootholdConfig(steppability="off"))
    spots = footholds_of(blind)[:, :2]

    def label_at(x, y):
        return np.where(
            np.hypot(*(np.stack((x, y))[..., None] - spots.T[:, None, None])).min(-1) < 0.05, NON_PASSABLE, STEPPABLE
        )

    careful = plan_along_x(regions, PENALTY, from_above(label_at))
    apart = np.linalg.norm(footholds_of(careful)[:, None, :2] - spots, axis=2).min()
    assert careful.success and apart > 0.05 + R - 0.02, "but for a pixel no point of a foot is on them"
    assert careful.stances[-1].p_WB[0] > blind.stances[-1].p_WB[0] - 0.3, "it gets as far"


def strip_of(label):
    """A strip across all of the way, too wide to step over, of tiles of one label."""
    return labelled(worlds.flat_ground(), lambda x, y: label if 0.75 < x < 1.8 else STEPPABLE)


def walk(regions, config, goal, max_plans=16):
    """Plan after plan, harder after each failure, as the monitor asks for them; returns the plans and the last state."""
    state, level, plans = worlds.standing_state(ROBOT), 0, []
    while np.hypot(*(state.p_WB[:2] - goal)) > 0.2 and level < 4 and len(plans) < max_plans:
        path = search_torso_path(
            state.p_WB, state.rpy_WB[2], regions, goal, ROBOT, TorsoConfig(), level=level, every_label=config.every_label
        )
        plan = search_footholds(state, path.regions, path, ROBOT, config)
        level = max(level - 1, 0) if plan.success else level + 1
        if plan.success:
            plans.append(plan)
            state = worlds.state_at(ROBOT, plan.stances[-1])
    return plans, state


@pytest.mark.parametrize("label", [PASSABLE, NON_PASSABLE])
def test_what_cannot_be_avoided_is_stepped_on(label):
    regions = strip_of(label)
    for steppability, crosses in (("exclude", False), ("penalty", True), ("off", True)):
        _, state = walk(regions, FootholdConfig(steppability=steppability), (2.3, 0.0))
        assert (state.p_WB[0] > 2.0) == crosses, steppability


def test_of_two_ways_the_passable_one():
    """Left of the middle line all is non-passable, right of it passable."""
    regions = labelled(worlds.flat_ground(), lambda x, y: STEPPABLE if x < 0.75 else NON_PASSABLE if y > 0.05 else PASSABLE)
    shares = {}
    for steppability in ("penalty", "off"):
        plans, state = walk(regions, FootholdConfig(steppability=steppability), (1.8, -0.4))
        labels = np.concatenate([labels_of(plan) for plan in plans])
        assert state.p_WB[0] > 1.6
        shares[steppability] = (labels == NON_PASSABLE).sum() / (labels != STEPPABLE).sum()
    assert shares["penalty"] < 0.5 * shares["off"], shares


def test_a_search_that_gives_up_does_not_end_on_bad_ground():
    """At its bound of expansions the best stance counts what it stepped on, not only how far it leads."""
    regions = strip_of(NON_PASSABLE)
    plan = plan_along_x(regions, replace(PENALTY, max_expansions=4, min_progress=0.05))
    assert plan.success
    assert not [r for stance in plan.stances for r in stance.regions if r.label == NON_PASSABLE]


def test_exclude_looks_at_no_image():
    regions = worlds.stepping_stones()
    plans = [plan_along_x(regions, FootholdConfig(), image) for image in (None, from_above(lambda x, y: NON_PASSABLE))]
    for a, b in zip(plans[0].stances, plans[1].stances, strict=True):
        np.testing.assert_array_equal(a.footholds, b.footholds)
    assert plans[0].expansions == plans[1].expansions


def test_unknown_words_are_refused():
    for key in ("steppability", "steppability_unknown", "steppability_occluded", "steppability_unseen"):
        with pytest.raises(UserInputError, match=f"{key} 'maybe'"):
            FootholdConfig(**{key: "maybe"})
