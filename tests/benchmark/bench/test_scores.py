"""What is counted from rows, and how sure one may be of it."""

import polars
import pytest
from scipy.stats import norm

from quadpips_drake.benchmark.bench.reporting.published import GOALS_REACHED, INFERRED, TRIALS, published
from quadpips_drake.benchmark.bench.reporting.results import results_table, write_results
from quadpips_drake.benchmark.bench.reporting.summary import markdown_table, summary
from quadpips_drake.benchmark.bench.scores import Score, tally
from quadpips_drake.benchmark.bench.settings import BenchSettings
from quadpips_drake.terrain.suites import suite_terrains
from tests.benchmark.bench.fake_trials import SETTINGS, fake_row

ROWS = [fake_row(spec) for spec in SETTINGS.trial_specs()]


@pytest.mark.parametrize(("reached", "trials"), [(0, 10), (7, 10), (10, 10), (95, 100)])
def test_intervals_are_wilsons(reached, trials):
    z = norm.ppf(0.975)
    middle = (reached + 0.5 * z * z) / (trials + z * z)
    half = z / (trials + z * z) * (reached * (trials - reached) / trials + 0.25 * z * z) ** 0.5
    assert Score(reached, trials).interval == pytest.approx((max(middle - half, 0.0), min(middle + half, 1.0)), abs=1e-9)


def test_the_paper_counts():
    totals = {planner: sum(max(counts) for counts in of.values()) for planner, of in GOALS_REACHED.items()}
    assert totals == {"quadpips": 91, "s_mpc": 68, "em_mpc": 47}
    assert set(suite_terrains("paper", "anymal_c")) <= set(GOALS_REACHED["quadpips"]) == set(GOALS_REACHED["em_mpc"])
    assert all(INFERRED[planner] <= set(of) for planner, of in GOALS_REACHED.items())
    assert published("anymal_c", "quadpips", "pegboard") == "8/10"
    assert published("anymal_c", "quadpips", "obstructed_balance_beam") == "9/10 or 10/10"
    assert published("anymal_c", "em_mpc", "sparse_stones") == "0/10"
    assert published("anymal_c", "em_mpc", "stairs_10") == "(10/10)"
    assert published("go2", "quadpips", "pegboard") == published("anymal_c", "s_mpc", "obstructed_balance_beam") == ""
    assert published("anymal_c", "quadpips", "pegboard", difficulty=0.2) == ""
    assert published("anymal_c", "lf_mpc", "pegboard") == published("anymal_c", "quadpips", "flat") == ""
    assert TRIALS == 10


def test_successes_are_counted_by_kind():
    assert tally(ROWS, ("terrain",)) == {("ramp_10",): Score(4, 6), ("stairs",): Score(4, 6)}
    assert tally(ROWS, ()) == {(): Score(8, 12)}


def test_the_summary_says_all_that_matters():
    text = summary(SETTINGS, ROWS)
    assert "| anymal_c | ramp_10 | quadpips | 4/6 | 67 % | 30 % to 90 % | (10/10) |" in text
    assert "| anymal_c | **all** | quadpips | 8/12 | 67 % |" in text
    assert text.count("roll \\| pitch reached 0.81 rad") == 4, "failures, each with its detail, which breaks no table"
    assert "| anymal_c | stairs | quadpips | 3 | 24 | 240 | 12 | 6 | 16.0 s | none |" in text
    assert "| foothold_search | 60 | 24.00 | 20.00 | 40.00 | 60.00 |" in text
    assert "not complete" not in text.lower()
    half = summary(SETTINGS, ROWS[:5])
    assert "7 of 12 trials are missing" in half
    other = [{**ROWS[0], "versions": {"python": "4"}}, *ROWS[1:]]
    assert "different versions" in summary(SETTINGS, other) and "different versions" not in text


def test_a_summary_of_nothing_but_errors_can_be_written():
    bare = {
        **ROWS[0],
        "reason": "error",
        "success": False,
        "progress": [],
        "timings_ms": {},
        "fallbacks": {},
        "sim_time": 0.0,
    }
    bare |= {"footholds": {"planned": 0, "slipped": 0, "missed": 0}, "realtime_factor": 0.0, "distance_to_goal": None}
    text = summary(BenchSettings(courses=SETTINGS.courses[:1], trials=1, seed=3), [bare])
    assert "0/1" in text and "Computing time" not in text


def test_cells_cannot_break_a_table():
    assert markdown_table(["a"], [["x|y\nz"]]).splitlines() == ["| a |", "|---|", "| x\\|y z |"]


def test_results_are_read_back_by_column(tmp_path):
    bare = {**ROWS[0], "timings_ms": {}, "distance_to_goal": None}
    write_results([bare, *ROWS[1:]], tmp_path / "results.parquet")
    table = polars.read_parquet(tmp_path / "results.parquet")
    assert table.equals(results_table([bare, *ROWS[1:]]))
    assert table["seed"].to_list() == [row["seed"] for row in ROWS]
    assert table["timings_ms.torso_search.p95"].to_list() == [None] + 11 * [8.0]
    assert table["fallbacks.swing_trajectory"].to_list() == [row["seed"] % 2 for row in ROWS]
    assert table["progress.fraction"][0].to_list() == [0.0, 0.45, 0.5]
    assert table["footholds.missed"].sum() == 24
