"""The commands dataset, train and evaluate network."""

import errno

import pytest
from typer.testing import CliRunner

from quadpips_drake.cli.main import app
from quadpips_drake.learning.data_factory import MIN_SCENES
from quadpips_drake.learning.dataset_config import DatasetConfig
from quadpips_drake.worker_pool import JobFailed, Outcome


def quadpips(*arguments):
    """Returns exit status, stdout and stderr of a command."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="quadpips")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def test_from_frames_to_scores(dataset_directory, tmp_path):
    model, scores = tmp_path / "model", tmp_path / "scores"
    status, out, err = quadpips("train", "--data", dataset_directory, "--out", model, "--epochs", 2, "--batch", 4)
    assert status == 0 and "mean IoU" in out
    said = err.splitlines()
    assert said[:3] == ["loading PyTorch", f"reading {dataset_directory}", "making the network"], "from the start on"
    assert said[3].startswith("training on 8 images") and "nan" not in err
    assert [line.split(",")[0] for line in said[4:]] == ["epoch 1", "epoch 2"]
    files = {"steppability.pt", "steppability.onnx", "steppability.json", "curves.png", "history.json"}
    assert {path.name for path in model.iterdir()} >= files
    status, out, _ = quadpips("evaluate", "network", "--data", dataset_directory, "--model", model, "--out", scores)
    assert status == 1  # two steps of training do not reach the targets
    assert "recall non_passable" in out
    names = {"evaluation.json", "steppability_confusion.png", "steppability_worst_frames.png"}
    assert {path.name for path in scores.iterdir()} == names
    before = [path.stat().st_mtime_ns for folder in (model, scores) for path in sorted(folder.iterdir())]
    for command in (["train", "--out", model, "--epochs", 2], ["evaluate", "network", "--model", model, "--out", scores]):
        status, _, err = quadpips(*command, "--data", dataset_directory)
        assert status == 2 and "holds results already" in err and "--overwrite" in err
    assert [path.stat().st_mtime_ns for folder in (model, scores) for path in sorted(folder.iterdir())] == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["dataset", "--out", "{tmp}", "--frames", 49], "equal to 50"),
        (["dataset", "--out", "{tmp}", "--frames", 50, "--swing-height", -1], "swing_height_max"),
        (["dataset", "--out", "/proc/nowhere", "--frames", 50], "cannot write"),
        (["train", "--data", "{tmp}", "--out", "{tmp}"], "no manifest.json"),
        (["train", "--data", "{data}", "--out", "{tmp}", "--resume"], "no checkpoint.pt"),
        (["evaluate", "network", "--data", "{tmp}"], "no manifest.json"),
        (["evaluate", "network", "--data", "{data}", "--model", "{tmp}"], "quadpips train"),
    ],
)
def test_bad_input_ends_with_one_line_and_status_2(dataset_directory, tmp_path, arguments, message):
    places = {"tmp": tmp_path, "data": dataset_directory}
    status, _, err = quadpips(*(str(argument).format(**places) for argument in arguments))
    assert status == 2
    lines = [line for line in err.splitlines() if line.startswith("error:")]
    assert len(lines) == 1 and message in lines[0]


def test_too_few_frames_are_refused_before_anything_is_written_as_the_help_says(tmp_path):
    least = MIN_SCENES * DatasetConfig().frames_per_scene
    assert quadpips("dataset", "--out", tmp_path / "data", "--frames", least - 1)[0] == 2
    assert not (tmp_path / "data").exists()
    assert f"[x>={least}]" in quadpips("dataset", "--help")[1]


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device; 1 of 3 shards lie there, --resume"),
        (JobFailed("its process ended abruptly (SIGKILL)"), "2 of 3 shards are missing (val_0000.npz: its process ended"),
    ],
)
def test_what_stops_a_dataset_is_one_line_and_what_was_made_is_kept(tmp_path, monkeypatch, error, reason):
    def breaks(jobs, workers):
        for k, key in enumerate(jobs):
            yield Outcome(key, error=error if k else None)

    monkeypatch.setattr("quadpips_drake.worker_pool.run_jobs", breaks)
    status, _, err = quadpips("dataset", "--out", tmp_path, "--frames", 50)
    assert status == 1 and (tmp_path / "manifest.json").is_file()
    lines = [line for line in err.splitlines() if line.startswith("error:")]
    assert len(lines) == 1 and reason in lines[0]


def test_an_interrupted_dataset_says_what_is_there(tmp_path, monkeypatch):
    def interrupted(jobs, workers):
        yield Outcome(next(iter(jobs)))
        raise KeyboardInterrupt

    monkeypatch.setattr("quadpips_drake.worker_pool.run_jobs", interrupted)
    status, _, err = quadpips("dataset", "--out", tmp_path, "--frames", 50)
    assert status == 130 and "interrupted; 1 of 3 shards lie in" in err


def test_a_dataset_is_not_overwritten(dataset_directory):
    status, _, err = quadpips("dataset", "--out", dataset_directory, "--frames", 50)
    assert status == 2 and "--resume" in err
