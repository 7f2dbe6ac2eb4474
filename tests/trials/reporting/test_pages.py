"""report.html and the comparison: whole pages that need no network and show no markup out of files."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.loading import load_config, load_walk_config
from quadpips_drake.trials.record import record_trial
from quadpips_drake.trials.reporting import report
from quadpips_drake.trials.reporting.case import Case
from quadpips_drake.trials.reporting.comparison_page import comparison_page
from quadpips_drake.trials.reporting.overview_figure import thinned
from quadpips_drake.trials.reporting.post_mortem import post_mortem_of
from quadpips_drake.trials.reporting.report import compare, tell
from quadpips_drake.trials.reporting.report_page import report_page
from quadpips_drake.trials.reporting.way_figure import way_figure
from quadpips_drake.trials.reporting.words import counted, last_lines, verdict
from tests.cli.test_commands import quadpips
from tests.trials.explaining.test_trial_explanation import Reader
from tests.trials.reporting.hand_made import FLAT, ROBOT, falling, noting, record, sliding, standing_log, with_sight
from tests.trials.toy_trial import ToyConfig, ToyTrial


def read(page: str) -> Reader:
    """The page, after it was seen to be whole and to fetch nothing."""
    assert page.startswith("<!DOCTYPE html>")
    reader = Reader(page)
    assert not [target for target in reader.targets if "//" in target and not target.startswith("data:image/png;base64,")]
    assert "<script" not in page
    return reader


def slipped(**fields):
    log = noting(falling(sliding(standing_log(), 0.9, 0.1)), (1.2, "safety", "<b>foot LF</b> has slipped by 0.12 m"))
    return record(log, detail="roll or pitch reached <b>0.80</b> rad", **fields)


def test_the_page_of_a_fall():
    trial = slipped(timings_ms={"mpc<": {"n": 100, "p50": 2.0, "p95": 3.0, "max": 9.0, "total": 210.0}})
    page = read(report_page(trial, post_mortem_of(trial)))
    for text in (
        "anymal_c on flat, seed 3",
        "most likely because of low friction",
        "reached <b>0.80</b> rad",
        "fell at t = 2.00 s: roll or pitch reached <b>0.80</b> rad",
        "stages.station.model_error.friction",
        "quadpips walk 'out/some trial/config.yaml'",
        "Asked in the last two seconds",
        "farthest that a foot slid while it stood: LF",
        "events in this time",
        "mpc<",
        "<b>foot LF</b> has slipped",
        "Measured too",
    ):
        assert text in page.text, text
    assert page.pictures == 5


def test_numbers_that_make_no_sense_together_end_with_one_line(tmp_path, monkeypatch):
    def broken(record):
        raise ValueError("zero-size array\nto reduction")

    monkeypatch.setattr(report, "post_mortem_of", broken)
    with pytest.raises(UserInputError, match=r"no report can be made of these files: zero-size array$"):
        report.write_report(replace(slipped(), folder=tmp_path))


def test_the_page_of_a_success_has_no_post_mortem():
    trial = record(
        with_sight(standing_log()), "goal_reached", walk=False, footholds={"planned": 4, "missed": 1, "slipped": 0}
    )
    page = read(report_page(trial, post_mortem_of(trial)))
    assert "Post-mortem" not in page.text
    assert (
        "anymal_c on flat reached its goal after 2.0 s (1 plans, 4 footholds, 1 missed, 0 slipped, 0 fallbacks" in page.text
    )
    assert page.pictures == 4


def test_a_page_of_what_little_there_is():
    trial = replace(slipped(), log={}, robot=None, terrain=None, remarks=("there is no log.npz",))
    page = read(report_page(trial, post_mortem_of(trial)))
    assert "there is no log.npz" in page.text and page.pictures == 0
    old = {
        k: v for k, v in standing_log().items() if not k.startswith(("asked", "mpc", "touch", "note", "swing", "planned"))
    }
    trial = replace(slipped(), log=old, robot=None, terrain=None)
    assert read(report_page(trial, post_mortem_of(trial))).pictures == 4
    broken = standing_log()
    broken["p_WB"][150:] = broken["foot_positions"][150:] = np.nan
    trial = replace(slipped(), log=broken)
    assert read(report_page(trial, post_mortem_of(trial))).pictures >= 4


def test_the_last_lines_say_the_same():
    trial = slipped()
    found = post_mortem_of(trial)
    cause, look, repeat = last_lines(replace(trial.result, cause={**vars(found.first), "keys": ["a.b", "c"]}), "again")
    assert cause.startswith(f"cause:     low friction, at t = {found.first.time:.2f} s: ")
    assert (look, repeat) == ("look at:   station; a.b, c", "repeat:    again")
    assert verdict(trial, found) == tell(trial, found)[0]
    assert last_lines(trial.result, "again") == []


def test_the_way_of_a_walk_leads_to_no_goal():
    for walk in (True, False):
        (axes,) = way_figure(Case(record(standing_log(), "upright", walk=walk))).axes
        names = {text.get_text() for text in axes.get_legend().get_texts()}
        assert ("goal" in names, "start" in names) == (not walk, True)
        assert axes.get_xlim()[1] == pytest.approx(0.8) if walk else axes.get_xlim()[1] > FLAT.goal[0]


def test_errors_of_landing_are_told_with_their_unit():
    told = counted({"planned": 4, "missed": 0, "landing_error_p50": 0.0017, "landing_error_max": None, "deepest_m": "?"})
    assert told == "planned 4, median landing error 1.7 mm, deepest m ?"
    assert counted({}) == "none"


def test_a_long_log_is_drawn_thin_but_to_its_end():
    log = standing_log(1001) | {"foothold_leg": np.zeros(3000, int)}
    thin = thinned(log, 100)
    assert len(thin["time"]) == len(thin["p_WB"]) <= 101
    assert thin["time"][-1] == log["time"][-1] and len(thin["foothold_leg"]) == 3000


def test_a_comparison(tmp_path):
    trials = [slipped(), record(standing_log(151, load=1.6), "upright"), replace(slipped(), log={}, robot=None)]
    page = read(comparison_page([(trial, post_mortem_of(trial)) for trial in trials], tmp_path / "comparison.html"))
    for text in ("Compared trials: 3", "low friction", "stayed upright", f"{1.6 * ROBOT.mass:.1f} kg", "0.10"):
        assert text in page.text, text
    compare([(trials[0], None), (trials[1], None)], tmp_path / "page.html")
    compare([(trials[0], None), (trials[1], None)], tmp_path / "page.html")
    (tmp_path / "mine.html").write_text("my notes")
    with pytest.raises(UserInputError, match="holds something else"):
        compare([(trials[0], None)], tmp_path / "mine.html")


def test_a_comparison_tells_other_settings_from_parts_that_are_not_there(tmp_path):
    run = record(standing_log(), "timeout", walk=False, config=load_config(seed=3))
    walk = record(standing_log(), "upright", config=load_walk_config(seed=4))
    text = read(
        comparison_page([(trial, None) for trial in (run, replace(walk, folder=tmp_path / "w"))], tmp_path / "c")
    ).text
    lacking = {
        name: text.partition(f"There is no such part in {name}: ")[2].partition(".\n")[0] for name in ("w", "some trial")
    }
    assert "stages.perception, " in lacking["w"] and "goal, " in lacking["w"] and "velocity" not in lacking["w"]
    assert "velocity, " in lacking["some trial"]
    assert "stages.perception." not in text and "stages.tracking.mpc.ocp.weights.base_orientation" in text and "seed" in text


def test_a_report_that_breaks_off_does_not_break_the_trial(tmp_path, monkeypatch):
    monkeypatch.setattr("quadpips_drake.trials.record.remove_broken_kernels", list)
    result = record_trial(ToyTrial, ToyConfig(duration=0.1), tmp_path, recording=False, warm_up=lambda: None)
    assert result.success
    assert "The report broke off" in read((tmp_path / "report.html").read_text()).text


def test_the_command(tmp_path):
    log = falling(sliding(standing_log(), 0.9, 0.1))
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        record(log).result.save(tmp_path / name / "result.json")
        np.savez_compressed(tmp_path / name / "log.npz", **log)
        (tmp_path / name / "config.yaml").write_text(f"terrain: flat\nseed: {len(name)}\n")
    status, output, errors = quadpips("report", tmp_path / "a", tmp_path / "b", "--out", tmp_path / "ab.html")
    assert (status, errors) == (0, "")
    assert output.count("most likely because of low friction") == 2
    assert f"compared:  {tmp_path / 'ab.html'}" in output
    read((tmp_path / "a" / "report.html").read_text())
    read((tmp_path / "ab.html").read_text())
    shutil.rmtree(tmp_path / "b")
    document = json.loads((tmp_path / "a" / "result.json").read_text())
    (tmp_path / "a" / "result.json").write_text(json.dumps(document | {"success": "\x1b[2J"}))
    for arguments in (
        (tmp_path / "a",),
        (tmp_path / "b",),
        (tmp_path,),
        (),
        (tmp_path / "a", "--out", tmp_path / "x.html"),
        [tmp_path] * 13,
    ):
        status, output, errors = quadpips("report", *arguments)
        assert status == 2 and len(errors.splitlines()) == 1 and "\x1b" not in errors and output == "", errors
