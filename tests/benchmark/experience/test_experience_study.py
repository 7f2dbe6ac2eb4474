"""The offline experiment: a series goes on until its first success, learns, and is taken up where it ended."""

import json

import numpy as np
import pytest

from quadpips_drake.benchmark.experience import experience_study as study
from quadpips_drake.benchmark.experience.course import OfflineCourse
from quadpips_drake.benchmark.experience.experience_picture import experience_figure
from quadpips_drake.benchmark.experience.experience_trial import COLLISION, GOAL, NO_PLAN, TrialRow
from quadpips_drake.diagrams.planning_module import PlanningConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.values.swing_plan import SwingOutcome
from tests.cli.test_run import quadpips
from tests.planning.experience.transitions import tried


class ScriptedWalker:
    """Reaches the goal as soon as so many swings are known to fail."""

    FAILURES = 2
    calls: list = []  # noqa: RUF012

    def __init__(self, course, config):
        self.scope = config.experience.scope

    def trial(self, library, labels=None, level=0):
        known = int((library.status == SwingOutcome.FAILED).sum())
        self.calls.append((known, level))
        if known >= self.FAILURES:
            return TrialRow(GOAL, search_ms=[1.0], path_cost=3.0), [tried()]
        swing = tried(outcome=SwingOutcome.FAILED, by=(0.1 * known, 0.0, 0.0))
        return TrialRow(COLLISION, "LF touches sphere 0", search_ms=[2.0]), [swing]


@pytest.fixture
def walker(monkeypatch):
    monkeypatch.setattr(study, "Walker", ScriptedWalker)
    ScriptedWalker.calls.clear()
    return ScriptedWalker


def series(mode="experience", seed=0):
    (one,) = study.all_series("anymal_c", "irregular_stones", [mode], ["exact"], [seed])
    return one


def test_a_series_learns_and_ends_with_its_first_success(walker, tmp_path):
    result = study.run_series(series(), 10, PlanningConfig(), tmp_path)
    assert [row["result"] for row in result["rows"]] == [COLLISION, COLLISION, GOAL]
    assert [row["records"] for row in result["rows"]] == [1, 2, 3]
    assert study.failures_before_success(result["rows"]) == 2


def test_an_interrupted_series_is_taken_up(walker, tmp_path):
    study.run_series(series(), 1, PlanningConfig(), tmp_path)
    assert walker.calls == [(0, 0)]
    result = study.run_series(series(), 10, PlanningConfig(), tmp_path)
    assert walker.calls == [(0, 0), (1, 0), (2, 0)]
    assert study.failures_before_success(result["rows"]) == 2
    study.run_series(series(), 10, PlanningConfig(), tmp_path)
    assert len(walker.calls) == 3


def test_general_experience_is_shared_by_the_seeds(walker, tmp_path):
    for seed, expected in ((0, [(0, 0), (1, 0), (2, 0)]), (1, [(2, 0)])):
        walker.calls.clear()
        (one,) = study.all_series("anymal_c", "irregular_stones", ["experience"], ["exact"], [seed], "general")
        study.run_series(one, 10, PlanningConfig(), tmp_path)
        assert walker.calls == expected
    assert (tmp_path / "library-experience.npz").exists()


def test_what_lies_in_the_folder_is_checked(walker, tmp_path):
    one = series()
    study.run_series(one, 1, PlanningConfig(), tmp_path)
    (journal,) = (tmp_path / "series").glob("*.json")
    journal.with_suffix(".npz").write_bytes(b"something else")
    with pytest.raises(UserInputError, match="truncated or damaged"):
        study.run_series(one, 10, PlanningConfig(), tmp_path)
    journal.write_text(json.dumps({"rows": [{"result": "goal"}]}))
    with pytest.raises(UserInputError, match="is no file of trials"):
        study.run_series(one, 10, PlanningConfig(), tmp_path)


def test_a_trial_that_would_be_the_same_again_is_not_run_again(walker, tmp_path):
    result = study.run_series(series("none"), 30, PlanningConfig(), tmp_path)
    assert len(walker.calls) == 2, "once more, to see that it is the same"
    assert len(result["rows"]) == 30
    assert [row["repeated"] for row in result["rows"]] == [False, False] + [True] * 28
    assert study.failures_before_success(result["rows"]) is None


def test_after_no_plan_it_tries_harder(tmp_path, monkeypatch, walker):
    monkeypatch.setattr(
        walker, "trial", lambda self, library, labels, level: (walker.calls.append(level), (TrialRow(NO_PLAN), []))[1]
    )
    study.run_series(series("none"), 5, PlanningConfig(), tmp_path)
    assert walker.calls[:4] == [0, 1, 2, 3]


def test_the_regions_ignore_the_spheres_and_the_map_does_not():
    course = OfflineCourse(load_robot("anymal_c"), load_terrain("irregular_stones", seed=0))
    top = course.centers[0] + [0.0, 0.0, course.radii[0]]
    assert course.heights.at(top[:1], top[1:2])[0] == pytest.approx(top[2], abs=0.01)
    near = np.array([region.center for region in course._regions])
    beside = near[np.hypot(*(near[:, :2] - top[:2]).T) < 0.1]
    assert len(beside)
    assert (beside[:, 2] < top[2] - 0.05).all()


def test_table_and_picture(tmp_path):
    rows = {"none": [TrialRow(COLLISION, search_ms=[5.0]).as_dict()] * 4}
    rows["experience"] = [*rows["none"][:3], TrialRow(GOAL, search_ms=[9.0], path_cost=2.0).as_dict()]
    chosen = [series(mode) for mode in rows]
    results = {one.key: {"rows": rows[one.mode]} for one in chosen}
    lines = study.table_rows(chosen, results)
    assert lines[0][:4] == ("none", "0 of 1", "0 of 1", "-")
    assert lines[1][:5] == ("experience", "1 of 1", "0 of 1", "3", "2.00")
    figure = experience_figure(chosen, results, 4)
    assert [len(axes.lines) for axes in figure.axes[1:]] == [3, 3, 3]


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--modes", "fast", "unknown mode 'fast'"),
        ("--labels", "x", "unknown kind of labels"),
        ("--scope", "x", "unknown scope"),
    ],
)
def test_wrong_options_are_refused_in_one_line(option, value, words, tmp_path):
    status, _, errors = quadpips("evaluate", "experience", option, value, "--out", tmp_path)
    assert (status, errors.count("\n")) == (2, 1)
    assert words in errors


def test_experience_that_cannot_be_used_is_refused_before_anything_runs(tmp_path):
    spoiled = tmp_path / "mine.npz"
    spoiled.write_bytes(b"PK something")
    given = f"stages.planning.experience.file={spoiled}"
    status, _, errors = quadpips(
        "evaluate", "experience", "--modes", "experience", "--set", given, "--out", tmp_path / "out"
    )
    assert (status, errors.count("\n")) == (2, 1)
    assert "truncated or damaged" in errors
    assert spoiled.read_bytes() == b"PK something"
