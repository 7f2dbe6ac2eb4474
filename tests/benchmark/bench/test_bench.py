"""A bench loses no trial that is over and runs none twice, whatever happens to it or to its workers."""

import os
import signal
import subprocess
import sys
from functools import partial

import polars
import pytest

from quadpips_drake.benchmark.bench.bench import JOURNAL, claim, rows_of, run_missing
from quadpips_drake.benchmark.bench.journal import Journal, read_journal
from quadpips_drake.benchmark.bench.process_pool import ProcessPool
from quadpips_drake.benchmark.bench.reporting.reports import SUMMARY, write_reports
from quadpips_drake.benchmark.bench.reporting.results import RESULTS
from quadpips_drake.benchmark.bench.settings import BenchSettings, Course, courses_of, difficulties_of, load_settings
from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.suites import suite_terrains
from tests.benchmark.bench import fake_trials
from tests.benchmark.bench.fake_trials import SETTINGS, fake_row
from tests.source_tree import ROOT
from tests.test_worker_pool import PATIENCE, eventually


class Listener:
    """Notes what an onlooker is told."""

    def __init__(self):
        self.rows, self.lines = [], []

    def note(self, row):
        self.rows.append(row)

    def tell(self, text):
        self.lines.append(text)


def run_here(folder, run, *, settings=SETTINGS, workers=2, time_limit=None):
    """Runs what is missing in ``folder``; returns the rows and what was told."""
    listener = Listener()
    with Journal(folder / JOURNAL) as journal:
        run_missing(settings, journal, ProcessPool(workers, time_limit), listener, run)
        return rows_of(settings, journal.entries), listener


def test_all_trials_are_run_and_told_once(tmp_path):
    rows, listener = run_here(tmp_path, fake_trials.quick)
    assert rows == [fake_row(spec) for spec in SETTINGS.trial_specs()]
    assert sorted(row["seed"] for row in listener.rows) == sorted(2 * list(range(3, 9)))
    assert run_here(tmp_path, fake_trials.deadly)[1].rows == [], "nothing is left to do"


def test_a_trial_whose_worker_dies_is_run_once_more(tmp_path):
    notes = tmp_path / "notes"
    notes.mkdir()
    rows, listener = run_here(tmp_path, partial(fake_trials.deadly, notes), workers=1)
    by_key = {(row["terrain"], row["seed"]): row for row in rows}
    assert by_key["ramp_10", 4]["reason"] == "goal_reached"
    assert by_key["stairs", 4]["reason"] == "error" and "SIGKILL" in by_key["stairs", 4]["detail"]
    assert len(rows) == len(listener.rows) == 12
    begun = {path.name: path.read_text().count("\n") for path in notes.iterdir()}
    assert {name for name, times in begun.items() if times == 2} == {
        f"anymal_c-{terrain}-quadpips-4" for terrain in ("ramp_10", "stairs")
    }
    assert max(begun.values()) == 2
    assert sum("once more" in line for line in listener.lines) == 2


def test_a_trial_that_hangs_is_ended(tmp_path):
    settings = BenchSettings(courses=[Course("anymal_c", "stairs")], trials=1, seed=4)
    rows, listener = run_here(tmp_path, partial(fake_trials.endless, tmp_path), settings=settings, time_limit=2.0)
    assert rows[0]["reason"] == "error"
    assert "took longer than 2 s" in rows[0]["detail"]
    assert len(listener.lines) == 1 and "once more" in listener.lines[0]


def test_a_trial_that_cannot_be_had_is_an_error_with_its_reason(tmp_path):
    rows, listener = run_here(tmp_path, fake_trials.refused)
    details = {row["seed"]: row["detail"] for row in rows if row["reason"] == "error"}
    assert details == {5: "there is no ground under the start", 6: "ZeroDivisionError: float division by zero"}
    assert not listener.lines, "none of them is tried again: it would end in the same way"


def test_a_torn_line_is_dropped_and_its_trial_run_again(tmp_path):
    whole, _ = run_here(tmp_path, fake_trials.quick)
    journal = tmp_path / JOURNAL
    content = journal.read_bytes()
    for torn in (content[:-1], content[:-40], content[:-1] + b"\0\0\0\n"):
        journal.write_bytes(torn)
        with Journal(journal) as opened:
            assert len(opened.entries) == 11
            assert "torn" in opened.remarks[0]
        rows, listener = run_here(tmp_path, fake_trials.quick)
        assert len(listener.rows) == 1
        assert rows == whole
        assert read_journal(journal)[2] == []


def test_a_damaged_or_double_line_is_told(tmp_path):
    run_here(tmp_path, fake_trials.quick)
    journal = tmp_path / JOURNAL
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([*lines, lines[0].replace(b'"fell"', b'"timeout"')]))
    entries, _, remarks = read_journal(journal)
    assert len(entries) == 12 and "second entry" in remarks[0]
    assert not any(entry["reason"] == "timeout" for entry in entries.values()), "the first one counts"
    journal.write_bytes(b"".join([*lines[:3], b"{]\n", *lines[4:]]))
    with pytest.raises(UserInputError, match="line 4 is damaged"):
        Journal(journal)


def test_a_full_disk_leaves_the_journal_as_it_was(tmp_path):
    resource = pytest.importorskip("resource")
    with Journal(tmp_path / JOURNAL) as journal:
        journal.append("a", {"x": 1})
        before = journal.path.read_bytes()
        limits, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 5, limits[1]))
            with pytest.raises(UserInputError, match="cannot write"):
                journal.append("b", {"x": "long" * 100})
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
            signal.signal(signal.SIGXFSZ, handler)
        assert journal.path.read_bytes() == before
        journal.append("b", {"x": 2})
    assert list(read_journal(tmp_path / JOURNAL)[0]) == ["a", "b"]


def test_a_bench_that_is_killed_twice_gives_the_same_table(tmp_path):
    out, over = tmp_path / "out", set()
    for attempt, enough in enumerate((3, 7, None)):
        notes = tmp_path / f"notes {attempt}"
        notes.mkdir()
        process = start(out, notes)
        if enough is not None:
            wait_for_lines(out / JOURNAL, enough)
            process.kill()
        errors = process.communicate(timeout=5 * PATIENCE)[1]
        begun = {path.name for path in notes.iterdir()}
        assert not begun & over, "what was over is run again"
        over = {spec.file_name for spec in SETTINGS.trial_specs() if spec.key in read_journal(out / JOURNAL)[0]}
        assert enough is None or enough <= len(over) < 12
    assert process.returncode == 0, errors
    assert lines_of(out / JOURNAL) == 12
    whole = tmp_path / "whole"
    whole.mkdir()
    write_reports(SETTINGS, run_here(whole, fake_trials.quick)[0], whole)
    assert (out / SUMMARY).read_text() == (whole / SUMMARY).read_text()
    assert polars.read_parquet(out / RESULTS).equals(polars.read_parquet(whole / RESULTS))


@pytest.mark.parametrize(("ending", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_bench_keeps_its_trials_and_says_how_to_go_on(ending, status, tmp_path):
    out = tmp_path / "out"
    process = start(out, tmp_path)
    wait_for_lines(out / JOURNAL, 2)
    if ending == signal.SIGINT:
        os.killpg(process.pid, ending)  # as a terminal does: everyone gets it
    else:
        process.send_signal(ending)
    errors = " ".join(process.communicate(timeout=5 * PATIENCE)[1].split())
    assert process.returncode == status, errors
    kept = lines_of(out / JOURNAL)
    assert f"{kept} of 12 trials are kept; go on with: quadpips bench --out {out} --resume" in errors
    assert f"{12 - kept} of 12 trials are missing" in (out / SUMMARY).read_text()


def start(out, notes):
    """Starts a bench of slow fake trials as a program, the leader of a group of its own."""
    command = [sys.executable, "-m", "tests.benchmark.bench.fake_trials", "--out", str(out), "--notes", str(notes)]
    return subprocess.Popen(command, cwd=ROOT, start_new_session=True, text=True, stderr=subprocess.PIPE)


def wait_for_lines(path, number):
    """Waits until a file has so many lines."""
    eventually(lambda: lines_of(path), lambda lines: lines >= number)


def lines_of(path) -> int:
    """Whole lines in a file; none where there is no such file."""
    return path.read_bytes().count(b"\n") if path.exists() else 0


def test_a_folder_is_for_one_bench(tmp_path):
    claim(BenchSettings(), tmp_path, resume=False)
    claim(SETTINGS, tmp_path, resume=False)
    assert load_settings(tmp_path) == SETTINGS, "no trial of the other one is over"
    claim(SETTINGS, tmp_path, resume=True)
    run_here(tmp_path, fake_trials.quick)
    with pytest.raises(UserInputError, match="12 of 12 trials; add --resume"):
        claim(SETTINGS, tmp_path, resume=False)
    for other, what in (
        (BenchSettings(courses=SETTINGS.courses, trials=7, seed=3), "trials 6 there, 7 here"),
        (
            BenchSettings(courses=SETTINGS.courses[:1], trials=6, seed=3),
            "courses anymal_c on ramp_10, anymal_c on stairs there",
        ),
        (BenchSettings(courses=SETTINGS.courses, trials=6, seed=3, duration=2.0), "duration by default there, 2.0 here"),
    ):
        with pytest.raises(UserInputError, match=what):
            claim(other, tmp_path, resume=True)
    (tmp_path / "bench.yaml").unlink()
    with pytest.raises(UserInputError, match="without bench"):
        claim(SETTINGS, tmp_path, resume=True)


def test_trials_of_a_bench():
    courses = courses_of(["anymal_c", "go2"], ["paper", "flat", "stairs"])
    paper = suite_terrains("paper", "go2")
    assert [course.terrain for course in courses if course.robot == "go2"] == list(dict.fromkeys([*paper, "flat", "stairs"]))
    settings = BenchSettings(
        courses=courses, planners=["a", "b"], trials=2, seed=9, difficulties=difficulties_of("0.1:0.3:3")
    )
    specs = settings.trial_specs()
    assert len(specs) == len({spec.key for spec in specs}) == 2 * len(courses) * 2 * 3
    assert {spec.seed for spec in specs[: len(specs) // 2]} == {9}, "half a bench has all kinds"
    assert {spec.difficulty for spec in specs} == {0.1, 0.2, 0.3}
    for wrong in ("0.1:0.3", "0.3:0.1:4", "0:1:1", "0:1:2.5", "nan:1:3", "a:b:c"):
        with pytest.raises(UserInputError, match="LOW:HIGH:N"):
            difficulties_of(wrong)
    assert difficulties_of("0.25") == [0.25]
