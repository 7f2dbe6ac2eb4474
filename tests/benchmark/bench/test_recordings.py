"""Failures have recordings that show them, or it is said that they do not."""

from quadpips_drake.benchmark.bench.bench import JOURNAL, rows_of, run_missing
from quadpips_drake.benchmark.bench.journal import Journal
from quadpips_drake.benchmark.bench.process_pool import ProcessPool
from quadpips_drake.benchmark.bench.recordings import Recordings
from quadpips_drake.benchmark.bench.reporting.summary import summary
from quadpips_drake.benchmark.bench.rows import BenchTrial
from quadpips_drake.errors import UserInputError
from quadpips_drake.worker_pool import Outcome
from tests.benchmark.bench import fake_trials
from tests.benchmark.bench.fake_trials import SETTINGS, fake_row
from tests.benchmark.bench.test_bench import Listener

FAILED = [spec for spec in SETTINGS.trial_specs() if not fake_row(spec)["success"]]


class PoolHere:
    """Runs everything in this process."""

    def run(self, jobs, told):
        for key, job in jobs.items():
            try:
                yield Outcome(key, job())
            except UserInputError as error:
                yield Outcome(key, error=error)


def run_bench(folder, run, *, record=False):
    """Runs all trials with ``run``, then the recordings of the failures; returns the rows."""
    with Journal(folder / JOURNAL) as journal, Recordings(folder) as recorded:
        run_missing(SETTINGS, journal, PoolHere(), Listener(), run, recorded.keep if record else None)
        recorded.add_missing(SETTINGS, journal.entries, PoolHere(), Listener(), run)
        return rows_of(SETTINGS, journal.entries, recorded.journal.entries)


def test_failures_are_run_again_for_their_recordings(tmp_path):
    rows = run_bench(tmp_path, fake_trials.quick)
    assert [row.get("recording") for row in rows if not row["success"]] == [
        f"recordings/{spec.file_name}.html" for spec in FAILED
    ]
    assert all("recording" not in row for row in rows if row["success"])
    for spec in FAILED:
        assert (tmp_path / "recordings" / f"{spec.file_name}.html").read_text() == f"<html>{spec.key}"
    assert "[recording](recordings/anymal_c-ramp_10-quadpips-3.html) |" in summary(SETTINGS, rows)

    def never(spec, settings, record=False):
        raise AssertionError("all recordings are there")

    assert run_bench(tmp_path, never) == rows


def test_a_recording_of_another_run_is_told(tmp_path):
    def fickle(spec, settings, record=False):
        row = fake_row(spec, bits="others" if record and spec.seed == 6 else "")
        return BenchTrial({**row, "reason": "timeout"} if record and spec.seed == 6 else row, b"x" if record else None)

    text = summary(SETTINGS, run_bench(tmp_path, fickle))
    assert text.count("ANOTHER run") == 2
    assert "shows ANOTHER run than the one that was counted: anymal_c stairs quadpips seed 6: timeout after 16.0 s" in text


def test_what_cannot_be_recorded_is_told(tmp_path):
    def shy(spec, settings, record=False):
        if record and spec.seed == 3:
            raise UserInputError("no port is free")
        return BenchTrial(fake_row(spec), None)

    rows = run_bench(tmp_path, shy)
    remarks = [row["recording_remark"] for row in rows if not row["success"]]
    assert remarks == 2 * ["without a recording: no port is free"] + 2 * ["without a recording"]


def test_all_trials_can_be_recorded_at_once(tmp_path):
    calls = []

    def counting(spec, settings, record=False):
        calls.append(spec.key)
        return fake_trials.quick(spec, settings, record)

    rows = run_bench(tmp_path, counting, record=True)
    assert len(calls) == 12, "none is run twice"
    assert all((tmp_path / row["recording"]).exists() for row in rows)


def test_a_trial_that_never_began_is_not_run_again(tmp_path):
    with Journal(tmp_path / JOURNAL) as journal, Recordings(tmp_path) as recorded:
        run_missing(SETTINGS, journal, ProcessPool(1), Listener(), fake_trials.refused)
        assert {spec.seed for spec in recorded.missing(SETTINGS, journal.entries)} == {3}
