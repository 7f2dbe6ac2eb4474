"""``quadpips bench``: what is refused before any trial is run, and one real bench."""

import polars
import pytest

from quadpips_drake.benchmark.bench.bench import JOURNAL
from quadpips_drake.trials.result_directory import ResultDirectory
from tests.benchmark.bench import fake_trials
from tests.cli.test_run import quadpips

BAD_INPUT = [
    (["--robot", "spot"], ["unknown robot 'spot'", "anymal_c, go2"]),
    (["--robot", "anymal_c,,go2"], ["--robot 'anymal_c,,go2'", "A,B"]),
    (["--terrain", "flat,moon"], ["unknown terrain 'moon'"]),
    (["--planner", "magic"], ["unknown planner 'magic'"]),
    (["--regions", "magic"], ["unknown region source 'magic'"]),
    (["--set", "sead=3"], ["unknown key 'sead'"]),
    (["--set", "seed=3"], ["--set seed=3", "options of its own"]),
    (["--difficulty", "0.3:0.1:4"], ["--difficulty '0.3:0.1:4'", "LOW:HIGH:N"]),
    (["--terrain", "flat", "--difficulty", "0.1:0.3:2"], ["terrain 'flat' has no difficulty"]),
    (["--terrain", "gap", "--difficulty", "0.1:9:2"], ["difficulty of terrain 'gap'", "not 9"]),
    (["--trials", "0"], ["--trials"]),
    (["--trials", "100001"], ["trials", "100000"]),
    (["--duration", "-1"], ["duration"]),
    (["--seed", "2147483647"], ["last seed"]),
    (["--recordings", "some"], ["--recordings 'some'", "failed, all, none"]),
    (["--scheduler", "tcp://127.0.0.1:1", "--workers", "2"], ["--scheduler", "leave --workers"]),
    (["--resume"], ["holds no bench to go on with"]),
    (["--out", ""], ["--out", "empty name"]),
    (["compare", "here", "there"], ["here", "no bench"]),
]


@pytest.mark.parametrize(("arguments", "parts"), BAD_INPUT, ids=lambda value: " ".join(value))
def test_bad_input_ends_with_one_line_and_status_2(arguments, parts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("quadpips_drake.benchmark.bench.bench.run_missing", None)  # refused before any trial is run
    status, _, errors = quadpips("bench", *arguments)
    assert (status, errors.count("\n")) == (2, 1), errors
    assert errors.startswith("error: ")
    assert all(part in errors for part in parts), errors
    assert not (tmp_path / "out" / "bench" / JOURNAL).exists()


def test_two_benches_do_not_write_into_one_folder(tmp_path):
    with ResultDirectory(tmp_path, ()):
        status, _, errors = quadpips("bench", "--terrain", "flat", "--out", tmp_path)
    assert status == 2
    assert "another process is writing" in errors


def test_errors_of_the_program_show_in_the_exit_status(tmp_path, monkeypatch):
    monkeypatch.setattr("quadpips_drake.benchmark.bench.bench_trial.run_bench_trial", fake_trials.refused)
    monkeypatch.setattr("quadpips_drake.cli.bench.compile_kernels", lambda: True)
    what = ("bench", "--terrain", "flat", "--workers", "1", "--out", tmp_path)
    status, said, errors = quadpips(*what, "--trials", "3", "--seed", "1")
    assert status == 0, errors
    assert "anymal_c flat quadpips: 2 of 3 (0.21 to 0.94)" in said
    assert "[3/3] anymal_c flat quadpips seed 3: fell after 13.0 s: roll" in errors
    assert "failed trials are run again for their recordings: 1" in errors
    assert "[recording](recordings/anymal_c-flat-quadpips-3.html)" in (tmp_path / "summary.md").read_text()
    status, _, errors = quadpips(*what[:-1], tmp_path / "errors", "--trials", "1", "--seed", "5")
    assert status == 1
    assert "trials that ended in an error of the program: 1" in errors
    assert "there is no ground under the start" in (tmp_path / "errors" / "summary.md").read_text()


@pytest.mark.slow
def test_a_real_bench_is_run_and_resumed(tmp_path):
    what = ("bench", "--terrain", "flat,ramp_10", "--trials", "1", "--seed", "7", "--duration", "1")
    status, said, errors = quadpips(*what, "--workers", "1", "--out", tmp_path)
    assert status == 0, errors
    assert "anymal_c flat quadpips: 0 of 1" in said
    for terrain in ("flat", "ramp_10"):
        link = f"recordings/anymal_c-{terrain}-quadpips-7.html"
        assert "MeshCat" in (tmp_path / link).read_text()
        assert f"| [recording]({link}) |" in (tmp_path / "summary.md").read_text(), "the same bits once more"
    table = polars.read_parquet(tmp_path / "results.parquet")
    assert table["terrain"].to_list() == ["flat", "ramp_10"]
    assert table["reason"].to_list() == 2 * ["timeout"]
    assert table["timings_ms.whole_body_control.n"].min() > 100
    assert len(set(table["digest"])) == 2
    assert "| anymal_c | ramp_10 | quadpips | 0/1 |" in (tmp_path / "summary.md").read_text()

    journal = (tmp_path / JOURNAL).read_text()
    assert quadpips(*what, "--out", tmp_path)[0] == 2
    status, _, errors = quadpips(*what, "--trials", "2", "--out", tmp_path, "--resume")
    assert status == 2 and "trials 1 there, 2 here" in errors
    assert quadpips("bench", "--out", tmp_path, "--resume")[0] == 0
    assert (tmp_path / JOURNAL).read_text() == journal
    assert (tmp_path / "recordings.jsonl").read_text().count("\n") == 2
