"""The commands dataset, train and evaluate network."""

import pytest
from typer.testing import CliRunner

from quadpips_drake.cli.main import app


def quadpips(*arguments):
    """Returns exit status, stdout and stderr of a command."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="quadpips")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def test_from_frames_to_scores(dataset_directory, tmp_path):
    model, scores = tmp_path / "model", tmp_path / "scores"
    status, out, _ = quadpips("train", "--data", dataset_directory, "--out", model, "--epochs", 1, "--batch", 4)
    assert status == 0 and "mean IoU" in out
    assert {path.name for path in model.iterdir()} >= {"steppability.pt", "steppability.json", "curves.png", "history.json"}
    status, out, _ = quadpips("evaluate", "network", "--data", dataset_directory, "--model", model, "--out", scores)
    assert status == 1  # two steps of training do not reach the targets
    assert "recall non_passable" in out
    names = {"evaluation.json", "steppability_confusion.png", "steppability_worst_frames.png"}
    assert {path.name for path in scores.iterdir()} == names


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["dataset", "--out", "{tmp}", "--frames", 20], "at least 50"),
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


def test_a_dataset_is_not_overwritten(dataset_directory):
    status, _, err = quadpips("dataset", "--out", dataset_directory, "--frames", 50)
    assert status == 2 and "--resume" in err
