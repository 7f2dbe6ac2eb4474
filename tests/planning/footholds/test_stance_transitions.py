"""What one expansion finds, held against a plain loop over all combinations; and the families of stances."""

from itertools import product

import numpy as np
import pytest

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_problem import pose_problem
from quadpips_drake.planning.footholds.stance_rules import (
    REJECTIONS,
    arrivals,
    identities,
    make_transition_model,
    refusal,
    stance_deviation,
    support_distance,
)
from quadpips_drake.planning.footholds.stance_transitions import edge_cost, expand, leg_candidates, step_aims
from quadpips_drake.planning.nominal_pose import base_pose_above
from quadpips_drake.robots.robot_library import load_robot
from tests.planning import worlds

SWINGS = np.array([[0, 1, 2], [1, 0, 3], [2, 0, 0], [5, 3, 3]])  # name, first leg, last leg
PATH = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.1], [0.6, 0.1, 0.3], [0.9, 0.3, 0.6]])
REMAINING = np.array([1.0, 0.7, 0.4, 0.0])
WORLDS = {"stones": worlds.stepping_stones(), "flat": worlds.flat_ground(), "stairs": worlds.stairs()}


def way_to_go(p, yaw, weight):
    """min over the poses i of |pose - path_i| + remaining_i."""
    turns = abs(wrap_angle(PATH[:, 2] - yaw))
    return min(np.hypot(*(PATH[:, :2] - p[:2]).T) + weight * turns + REMAINING)


def plain_expansion(problem, p_WB, rpy_WB, swing, table, model):
    """All combinations of the legs' candidates: those that are permitted, in their order, and how many are refused why."""
    feet, normals, regions = problem.feet, problem.normals, problem.regions
    legs = sorted(set(swing[1:].tolist()), key=swing[1:].tolist().index)
    swinging = np.isin(np.arange(4), legs)
    aims, axes = step_aims(feet, swinging, rpy_WB[2], PATH, REMAINING, model), rotation_from_rpy(rpy_WB)
    candidates = []
    for leg in legs:
        where = leg, feet[leg], normals[leg], regions[leg]
        candidates.append(leg_candidates(*where, aims, p_WB, axes, table, model, problem.labels))
    found, refused = [], np.zeros(len(REJECTIONS), int)
    for choice in product(*(range(len(points)) for points, *_ in candidates)):
        new_feet, new_normals, new_regions = feet.copy(), normals.copy(), regions.copy()
        for leg, k, (points, upward, on, _) in zip(legs, choice, candidates, strict=True):
            new_feet[leg], new_normals[leg], new_regions[leg] = points[k], upward[k], on[k]
        p, rpy = base_pose_above(new_feet, model.base_height, model.max_tilt)
        apart = np.linalg.norm(new_feet[:, None] - new_feet, axis=2)[np.triu_indices(4, 1)].min()
        why = 0
        if apart >= 2.0 * model.foot_radius + model.leg_clearance:
            facing = np.cos(rpy_WB[2] - PATH[-1, 2])
            why = refusal(new_feet, new_normals, p, rpy, facing, PATH[-1, 2], model, np.empty((4, 3)))
        aside = support_distance(feet, swinging, *(0.5 * (p_WB + p))[:2])
        if why < 0 and aside > model.max_support_distance:
            why = REJECTIONS.index("out of balance")
        if why >= 0:
            refused[why] += 1
            continue
        cost = edge_cost(feet, new_feet, swinging, p_WB, rpy_WB, p, rpy, model) + model.support_weight * aside**2
        found.append((new_feet, new_normals, new_regions, p, rpy, cost, way_to_go(p, rpy[2], model.yaw_weight)))
    return found, refused


@pytest.mark.parametrize("robot", ["anymal_c", "go2"])
@pytest.mark.parametrize("world", WORLDS)
def test_an_expansion_finds_all_permitted_combinations(world, robot):
    robot, config = load_robot(robot), FootholdConfig(max_support_distance=0.03)
    problem = pose_problem(worlds.standing_state(robot), WORLDS[world], robot, config)
    table, model = problem.table, make_transition_model(robot, config)
    base = base_pose_above(problem.feet, model.base_height, model.max_tilt)
    stance = problem.feet, problem.normals, problem.regions
    *parts, by_labels, swings, refused = expand(*stance, SWINGS, *base, PATH, REMAINING, table, model, problem.labels)
    plain = [plain_expansion(problem, *base, swing, table, model) for swing in SWINGS]
    np.testing.assert_array_equal(refused, sum(counts for _, counts in plain))
    np.testing.assert_array_equal(swings, np.repeat(SWINGS[:, 0], [len(found) for found, _ in plain]))
    assert len(swings) > 20 and refused.sum() > 0 and not by_labels.any()
    for part, expected in zip(parts, zip(*(each for found, _ in plain for each in found), strict=True), strict=True):
        np.testing.assert_allclose(part, np.array(expected), rtol=1e-12, atol=1e-12)


def test_families_are_regions_and_places_of_the_standing_legs():
    rng = np.random.default_rng(0)
    feet, regions = rng.uniform(-0.05, 0.05, (40, 4, 3)), rng.integers(0, 3, (40, 4))
    radii, rows, standing = np.array([0.05, 0.2, 0.3]), np.arange(39, -1, -3), np.array([0, 3])
    found = identities(rows, feet, regions, 1, standing, radii, 0.05)
    for row, identity in zip(rows, found, strict=True):
        on = regions[row, standing]
        cells = np.floor(feet[row, standing] / 0.02) * (radii[on] > 0.05)[:, None]  # small regions are one place
        np.testing.assert_array_equal(identity, [1, *on, *cells.ravel()])


def test_arrivals():
    rng = np.random.default_rng(1)
    feet, p, rpy = rng.uniform(-0.5, 0.5, (60, 4, 3)), rng.uniform(-0.2, 0.2, (60, 3)), rng.uniform(-3.0, 3.0, (60, 3))
    nominal, waypoint, rows = rng.uniform(-0.5, 0.5, (4, 2)), np.array([0.05, -0.02, 3.0]), np.arange(60)[::-1].copy()
    arrive, deviations = arrivals(rows, feet, p, rpy, waypoint, 0.15, 0.8, nominal)
    near = np.linalg.norm(p[:, :2] - waypoint[:2], axis=1) <= 0.15
    expected = near & (np.cos(rpy[:, 2] - waypoint[2]) >= np.cos(0.8))
    assert 0 < expected.sum() < near.sum()
    np.testing.assert_array_equal(arrive, expected[rows])
    np.testing.assert_array_equal(deviations, [stance_deviation(feet[k], p[k], rpy[k, 2], nominal, 0.0) for k in rows])
