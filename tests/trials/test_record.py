"""What is written down of a trial, however it ends, and what becomes of earlier results."""

import errno
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.interruption import Terminated, interruptible
from quadpips_drake.trials import record
from quadpips_drake.trials.judge import Verdict
from quadpips_drake.trials.record import record_trial
from quadpips_drake.trials.trial_log import TrialLog
from tests.trials.toy_trial import ToyConfig, ToyTrial, save_recording

CONFIG = ToyConfig(duration=0.1)


@pytest.fixture(autouse=True)
def warm(monkeypatch):
    monkeypatch.setattr(record, "remove_broken_kernels", list)
    for name in ("draw_course", "start_recording"):
        monkeypatch.setattr(record, name, lambda *_, **__: None)
    monkeypatch.setattr(record, "save_recording", save_recording)


def run(out, config=CONFIG, **options):
    return record_trial(ToyTrial, config, out, **{"recording": False, "warm_up": lambda: None, **options})


def contents(folder: Path) -> dict:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def result_in(folder: Path) -> dict:
    return json.loads((folder / "result.json").read_text())


def test_a_trial_leaves_its_files_and_nothing_else(tmp_path):
    out = tmp_path / "new" / "one"
    assert run(out, recording=True, meshcat="none").success
    assert sorted(contents(out)) == ["config.yaml", "log.npz", "recording.html", "report.html", "result.json"]


def test_results_are_replaced_only_when_it_is_asked_for(tmp_path):
    run(tmp_path, recording=True, meshcat="none")
    before = contents(tmp_path)
    with pytest.raises(UserInputError, match=r"holds results already.*--overwrite"):
        run(tmp_path)
    assert contents(tmp_path) == before
    run(tmp_path, replace(CONFIG, seed=5), overwrite=True)
    assert result_in(tmp_path)["seed"] == 5
    assert "recording.html" not in contents(tmp_path), "that of another trial"


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("fails", ["input", "building"])
def test_a_refused_trial_deletes_nothing(overwrite, fails, tmp_path):
    run(tmp_path)
    before = contents(tmp_path)
    with pytest.raises(UserInputError):
        run(tmp_path, ToyConfig(fails=fails), overwrite=overwrite)
    assert contents(tmp_path) == before


def test_a_refused_trial_says_why_and_is_in_nobodys_way(tmp_path):
    with pytest.raises(UserInputError, match="goal makes no sense"):
        run(tmp_path, ToyConfig(fails="input"))
    assert result_in(tmp_path)["detail"] == "the goal makes no sense"
    assert run(tmp_path).success


def test_a_failed_assertion_in_building_is_written_down(tmp_path):
    result = run(tmp_path, ToyConfig(fails="building"))
    assert result.reason == result_in(tmp_path)["reason"] == "error"
    assert "condition 'mass > 0' failed" in result_in(tmp_path)["detail"]
    assert "SystemExit" in (tmp_path / "error.txt").read_text()
    run(tmp_path)
    assert not (tmp_path / "error.txt").exists()


@pytest.mark.parametrize(("fails", "detail"), [("assertion", "condition 'ok' failed"), ("memory", "MemoryError")])
def test_what_breaks_off_is_written_down(fails, detail, tmp_path):
    result = run(tmp_path, replace(CONFIG, fails=fails))
    assert (result.success, result.reason) == (False, "error")
    assert detail in result_in(tmp_path)["detail"]
    assert "Traceback" in (tmp_path / "error.txt").read_text()
    with np.load(tmp_path / "log.npz") as log:
        assert log["time"][-1] == pytest.approx(0.05)


@pytest.mark.parametrize(("signal", "kind"), [("SIGINT", KeyboardInterrupt), ("SIGTERM", Terminated)])
def test_an_interrupted_trial_is_written_down_though_the_signal_comes_again(signal, kind, tmp_path):
    with pytest.raises(kind), interruptible():
        run(tmp_path, replace(CONFIG, fails=signal), recording=True, meshcat="none")
    assert sorted(contents(tmp_path)) == ["config.yaml", "log.npz", "recording.html", "report.html", "result.json"]
    assert result_in(tmp_path)["reason"] == "interrupted"
    assert (tmp_path / "recording.html").read_text() == "0\n1\n2\n"


def test_an_interruption_while_building_leaves_nothing_new(tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    run(tmp_path / "old")
    before = contents(tmp_path / "old")
    monkeypatch.setattr(ToyTrial, "__init__", interrupted)
    for name in ("old", "new"):
        with pytest.raises(KeyboardInterrupt):
            run(tmp_path / name, overwrite=True)
    assert contents(tmp_path / "old") == before
    assert not (tmp_path / "new").exists()


def test_two_trials_never_write_into_one_directory(tmp_path, monkeypatch):
    original = ToyTrial.sample

    def sample(self):
        if self.context.get_time() == 0.0 and self.config.seed == 1:
            with pytest.raises(UserInputError, match="another process is writing"):
                run(tmp_path, replace(CONFIG, seed=2), overwrite=True)
        return original(self)

    monkeypatch.setattr(ToyTrial, "sample", sample)
    run(tmp_path, replace(CONFIG, seed=1))
    assert result_in(tmp_path)["seed"] == 1


def test_a_full_disk_keeps_what_could_be_written(tmp_path, monkeypatch):
    def full(self, path):
        path.with_name(f".new.{path.name}").write_text("")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(TrialLog, "save", full)
    with pytest.raises(UserInputError, match=r"goal reached after 0.1 s, but .*log.npz \(No space left") as caught:
        run(tmp_path)
    assert "there are result.json, config.yaml" in str(caught.value)
    assert result_in(tmp_path)["success"]


def test_a_full_disk_at_the_beginning_is_one_line(tmp_path, monkeypatch):
    def full(config, path):
        path.write_text("half of")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    run(tmp_path / "old")
    before = contents(tmp_path / "old")
    monkeypatch.setattr(record, "save_config", full)
    for name in ("old", "new"):
        with pytest.raises(UserInputError, match=r"cannot write there.*full"):
            run(tmp_path / name, overwrite=True)
    assert contents(tmp_path / "old") == before
    assert not (tmp_path / "new").exists()


def test_a_result_that_cannot_be_told_whole_is_told_in_part(tmp_path, monkeypatch):
    def blind(self, **more):
        raise RuntimeError("nothing to be seen")

    whole = ToyTrial.__mro__[1].result
    monkeypatch.setattr(ToyTrial, "result", blind)
    assert ToyTrial.__mro__[1].result is whole
    run(tmp_path)
    assert result_in(tmp_path)["reason"] == "goal_reached"
    assert "nothing to be seen" in (tmp_path / "error.txt").read_text()


def test_kernels_are_compiled_before_anything_is_built(tmp_path):
    built = []
    run(tmp_path, warm_up=lambda: built.append(ToyTrial.built))
    assert built == [ToyTrial.built - 1]
    with pytest.raises(UserInputError, match="holds results"):
        run(tmp_path, warm_up=lambda: built.append("although the directory is taken"))
    assert len(built) == 1


def test_a_recording_goes_on_after_a_fall_and_the_result_does_not(tmp_path, monkeypatch):
    ends = []
    monkeypatch.setattr(record, "save_recording", lambda recorder, path, story, robot: path.write_text("recorded"))
    for reason in ("fell", "goal_reached"):
        monkeypatch.setattr(ToyTrial, "time_is_up", lambda self, reason=reason: Verdict(reason, ""))
        monkeypatch.setattr(ToyTrial, "go_on", lambda self, duration: ends.append((self.verdict.reason, duration)))
        assert run(tmp_path / reason, recording=True, meshcat="none").sim_time == pytest.approx(0.1)
    assert ends == [("fell", record.AFTERMATH)]


def test_going_on_moves_time_and_nothing_else(monkeypatch):
    trial = ToyTrial(CONFIG)
    trial.run()
    samples, verdict = len(trial.log), trial.verdict
    trial.go_on(0.5)
    assert trial.context.get_time() == pytest.approx(0.6)
    assert (len(trial.log), trial.verdict) == (samples, verdict)

    def broken(self):
        raise SystemExit("Failure at plant.cc:1")

    monkeypatch.setattr(ToyTrial, "prepare_world", broken)
    trial.go_on(0.5)
