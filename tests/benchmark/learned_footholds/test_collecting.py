"""Data for the network: no seeds of trials, wishes that a plain walk fulfils, the same rows with the same seed."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.baselines.learned_footholds.swing_data import SPLITS, Swings
from quadpips_drake.baselines.learned_footholds.swing_view import INPUTS
from quadpips_drake.benchmark.learned_footholds import collecting
from quadpips_drake.benchmark.learned_footholds.collecting import (
    FIRST_SEED,
    TERRAINS,
    PlannedCourse,
    collect,
    collected,
    course_rows,
    plan_courses,
    plan_rows,
)
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.environments.flat import flat
from quadpips_drake.trials.loading import load_config
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, Stance
from tests.baselines.hand_made import floor

PAIRS = ((Leg.LF, Leg.RH), (Leg.RF, Leg.LH))


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def test_no_seed_is_one_of_a_trial_and_each_split_has_each_terrain():
    courses = plan_courses(7, 1000)
    assert min(course.seed for course in courses) >= FIRST_SEED and len({course.seed for course in courses}) == 56
    for split in SPLITS:
        assert {course.terrain for course in courses if course.split == split} == set(TERRAINS)
    for rounds, seed, message in ((5, 999, "seeds below 1000"), (5, 100, "of trials"), (4, 1000, "at least 5")):
        with pytest.raises(UserInputError, match=message):
            plan_courses(rounds, seed)


def steady_plan(robot, stride=0.08, swings=6) -> FootholdPlan:
    """Diagonal pairs by turns, each ``stride`` ahead of the other, on level ground."""
    nominal = np.column_stack((robot.nominal_footholds_B[:, :2], np.zeros(4)))
    feet, stances = nominal.copy(), []
    feet[list(PAIRS[1])] += [stride, 0.0, 0.0]
    for swing in range(swings + 1):
        base = np.append(feet[:, :2].mean(axis=0) - nominal[:, :2].mean(axis=0), 0.5)
        stances.append(Stance(feet.copy(), np.tile([0.0, 0.0, 1.0], (4, 1)), floor().regions * 4, base, np.zeros(3)))
        feet[list(PAIRS[swing % 2])] += [2 * stride, 0.0, 0.0]
    return FootholdPlan(0.0, 1, tuple(stances), tuple(PAIRS[k % 2] for k in range(swings)))


def test_a_walk_at_a_steady_pace_goes_where_it_wishes_to(robot):
    rows = Swings.of(plan_rows(steady_plan(robot), floor(), robot, number=3))
    assert len(rows) == 12 and (rows.walk == 3).all()
    np.testing.assert_allclose(rows.offsets, 0.0, atol=1e-6)
    np.testing.assert_allclose(rows.nearest, 0.0, atol=1e-6)
    np.testing.assert_allclose(rows.inputs[:, -3:-1], np.tile([0.08, 0.0], (12, 1)), atol=1e-6)


def test_a_foothold_aside_is_an_offset_outward(robot):
    plan = steady_plan(robot)
    last, legs = plan.stances[-1], plan.swing_legs[-1]
    feet = np.array(last.footholds)
    feet[legs[0], 1] += 0.05  # to the left: outward of RF it is -5 cm
    stances = (*plan.stances[:-1], replace(last, footholds=feet))
    rows = Swings.of(plan_rows(replace(plan, stances=stances), floor(), robot))
    np.testing.assert_allclose(rows.offsets[-2], [0.0, -0.05], atol=1e-6)
    np.testing.assert_allclose(np.delete(rows.offsets, -2, axis=0), 0.0, atol=1e-6)


def test_it_asks_the_search_from_plan_to_plan_and_the_same_seed_gives_the_same_rows(robot):
    planning, terrain = load_config("anymal_c").stages.planning, replace(flat(size=4.4), goal=np.array([0.9, 0.0]))
    first, second = (Swings.of(course_rows(robot, planning, terrain, np.random.default_rng(5), number=2)) for _ in range(2))
    assert len(first) >= 12 and np.array_equal(first.inputs, second.inputs) and np.array_equal(first.offsets, second.offsets)
    assert np.abs(first.inputs[:, :100]).max() < 1e-3  # level ground
    assert np.abs(first.offsets).max() < 0.3 and np.abs(first.offsets.mean(axis=0)).max() < 0.05


@pytest.fixture
def walked(monkeypatch):
    """The search is not asked: each walk has three swings that are made up; the numbers of those walked, in their order."""
    numbers = []

    def rows(robot, planning, terrain, rng, number):
        numbers.append(number)
        return [(rng.standard_normal(INPUTS), rng.standard_normal(2), np.zeros(2), number) for _ in range(3)]

    monkeypatch.setattr(collecting, "course_rows", rows)
    return numbers


def test_a_collection_that_was_interrupted_goes_on(robot, walked, tmp_path):
    courses = plan_courses(5, 1000)
    whole, part = tmp_path / "whole", tmp_path / "part"
    assert list(collect(robot, courses, 1000, whole)) == [(done, 40) for done in range(41)]
    walks = collect(robot, courses, 1000, part)
    assert [next(walks)[0] for _ in range(8)] == list(range(8))
    walks.close()
    with pytest.raises(UserInputError, match="add --resume"):
        next(collect(robot, courses, 1000, part))
    with pytest.raises(UserInputError, match="made with other options"):
        next(collect(robot, plan_courses(5, 2000), 2000, part, resume=True))
    walked.clear()
    assert [done for done, _ in collect(robot, courses, 1000, part, resume=True)] == list(range(7, 41))
    assert walked == list(range(7, 40))
    first, second = (collected(courses, folder) for folder in (whole, part))
    assert len(first) == 120 and all(np.array_equal(getattr(first, k), getattr(second, k)) for k in vars(first))


@pytest.mark.slow
def test_the_rows_are_the_same_with_two_workers(robot, tmp_path):
    courses = [PlannedCourse(number, "flat", 1000 + number, "train") for number in range(2)]
    for workers in (1, 2):
        assert list(collect(robot, courses, 1000, tmp_path / str(workers), workers=workers)) == [(0, 2), (1, 2), (2, 2)]
    first, second = (collected(courses, tmp_path / str(workers)) for workers in (1, 2))
    assert len(first) > 20 and all(np.array_equal(getattr(first, k), getattr(second, k)) for k in vars(first))
