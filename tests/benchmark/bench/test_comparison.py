"""Two benches, pair by pair."""

import pytest
from scipy.stats import binom

from quadpips_drake.benchmark.bench.reporting.comparison import comparison, pairs
from quadpips_drake.benchmark.bench.scores import Comparison, compared
from quadpips_drake.errors import UserInputError
from tests.benchmark.bench.fake_trials import SETTINGS, fake_row
from tests.cli.test_run import quadpips

ROWS = [fake_row(spec) for spec in SETTINGS.trial_specs()]
BETTER = [{**row, "success": True, "reason": "goal_reached"} if row["terrain"] == "stairs" else row for row in ROWS]


def test_outcomes_are_counted_by_pair():
    assert compared([(True, True), (True, False), (True, False), (False, False)]) == Comparison(1, 2, 0, 1)
    assert Comparison(5, 0, 0, 5).p_value == 1.0
    # The sum of the two tails of a binomial distribution: McNemar (1947), exact form.
    assert Comparison(80, 1, 9, 10).p_value == pytest.approx(2.0 * binom.cdf(1, 10, 0.5))


def test_trials_are_paired_by_robot_terrain_and_seed():
    other = [{**row, "planner": "rival"} for row in reversed(ROWS[:-3])]
    found = pairs(ROWS, other)
    assert len(found) == 9
    assert all(a["seed"] == b["seed"] and a["terrain"] == b["terrain"] for a, b in found)
    assert pairs(ROWS, [{**row, "difficulty": 0.1} for row in ROWS]) == []


def test_the_page_says_who_is_better_and_where():
    text = comparison(ROWS, BETTER, "old", "new")
    assert "# A: old, B: new" in text
    assert "| anymal_c | ramp_10 | 6 | 67 % | 67 % | 4 | 0 | 0 | 2 | 1 |" in text
    assert "| anymal_c | stairs | 6 | 67 % | 100 % | 4 | 0 | 2 | 0 | 0.5 |" in text
    assert "|  | **all** | 12 | 67 % | 83 % | 8 | 0 | 2 | 2 | 0.5 |" in text
    assert "| anymal_c | stairs | 3 | fell after 13.0 s | goal reached after 13.0 s |" in text
    assert "in one of the two only" not in text
    assert "3 trials are in one of the two only" in comparison(ROWS, BETTER[:-3], "old", "new")


def test_planners_are_compared_where_it_is_clear_which():
    rival = [{**row, "planner": "rival"} for row in ROWS]
    assert "## A: quadpips, B: rival" in comparison(ROWS, rival, "a", "b")
    assert "## quadpips" in comparison(ROWS + rival, rival + ROWS, "a", "b")
    with pytest.raises(UserInputError, match="of the planners quadpips, rival, b of rival"):
        comparison(ROWS + rival, rival, "a", "b")
    with pytest.raises(UserInputError, match="no trial in common"):
        comparison(ROWS, [{**row, "seed": 900 + row["seed"]} for row in ROWS], "a", "b")


def test_the_command_compares_two_folders(tmp_path):
    from quadpips_drake.benchmark.bench.bench import JOURNAL
    from quadpips_drake.benchmark.bench.journal import Journal
    from quadpips_drake.benchmark.bench.settings import save_settings

    for name, rows in (("a", ROWS), ("b", BETTER)):
        (tmp_path / name).mkdir()
        save_settings(SETTINGS, tmp_path / name)
        with Journal(tmp_path / name / JOURNAL) as journal:
            for spec, row in zip(SETTINGS.trial_specs(), rows, strict=True):
                journal.append(spec.key, row)
    status, said, errors = quadpips("bench", "compare", tmp_path / "a", tmp_path / "b")
    assert status == 0, errors
    assert said.strip() == comparison(ROWS, BETTER, str(tmp_path / "a"), str(tmp_path / "b")).strip()
    status, said, _ = quadpips("bench", "compare", tmp_path / "a", tmp_path / "b", "--out", tmp_path / "c.md")
    assert (tmp_path / "c.md").read_text().startswith("# A: ")
