"""The commands learned-footholds collect and train."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from quadpips_drake.baselines.learned_footholds import training
from quadpips_drake.baselines.learned_footholds.model_file import load_network, save_network
from quadpips_drake.baselines.learned_footholds.swing_view import INPUTS
from quadpips_drake.benchmark.learned_footholds import collecting
from quadpips_drake.cli.main import app
from tests.baselines.learned_footholds.made_up import constant_network, write_swings


def quadpips(*arguments):
    """Returns exit status, stdout and stderr of a command."""
    result = CliRunner().invoke(app, [*map(str, arguments)], prog_name="quadpips")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """The search is not asked: each walk has twelve swings that are made up; returns the numbers of those walked."""
    walked = []

    def rows(robot, planning, terrain, rng, number):
        walked.append(number)
        return [(rng.standard_normal(INPUTS), np.zeros(2), np.zeros(2), number) for _ in range(12)]

    monkeypatch.setattr(collecting, "course_rows", rows)
    monkeypatch.setattr(training, "EPOCHS", 3)
    return walked


def test_from_the_search_to_a_network(at_once, tmp_path):
    data, model = tmp_path / "data", tmp_path / "model"
    status, said, _ = quadpips("learned-footholds", "collect", "--rounds", 5, "--seed", 2000, "--out", data)
    assert status == 0 and "480 swings of 40 walks" in said and at_once == list(range(40))
    manifest = json.loads((data / "manifest.json").read_text())
    assert [walk["seed"] for walk in manifest["walks"]] == list(range(2000, 2040)) and manifest["robot"] == "anymal_c"
    assert {path.name for path in data.iterdir()} == {"manifest.json", "swings.npz"}
    assert quadpips("learned-footholds", "collect", "--rounds", 5, "--out", data)[0] == 2  # holds data already
    status, said, _ = quadpips("learned-footholds", "train", "--data", data, "--out", model)
    assert status == 0 and "swings: 288 train, 96 val, 96 test" in said
    assert "the heuristic's wish as it is: 0.0 cm, 0.0 cm, 0.0 cm" in said and "the network, before" in said
    assert {path.name for path in model.iterdir()} == {"footholds.npz", "footholds.json", "curves.png"}
    assert load_network("anymal_c", model).robot == "anymal_c"
    assert quadpips("learned-footholds", "train", "--data", data, "--out", model)[0] == 2  # holds results already


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["learned-footholds", "collect", "--out", "{tmp}", "--seed", 104], "seeds below 1000 are those of trials"),
        (["learned-footholds", "collect", "--out", "{tmp}", "--rounds", 2], "at least 5"),
        (["learned-footholds", "collect", "--out", "{tmp}", "--robot", "nobody"], "nobody"),
        (["learned-footholds", "collect", "--out", "/proc/nowhere"], "cannot write"),
        (["learned-footholds", "train", "--data", "{tmp}", "--out", "{tmp}/model"], "no manifest.json"),
        (["learned-footholds", "train", "--data", "{few}", "--out", "{tmp}/model"], "too few"),
        (
            ["run", "--planner", "lf_mpc", "--out", "{tmp}/run", "--set", "stages.heuristic.reference.learned_model={tmp}"],
            "learned-footholds train",
        ),
        (
            ["run", "--planner", "lf_mpc", "--out", "{tmp}/run", "--set", "stages.heuristic.reference.learned_model={go2}"],
            "of the robot go2, not anymal_c",
        ),
    ],
)
def test_bad_input_ends_with_one_line_and_status_2(tmp_path, arguments, message):
    places = {name: tmp_path / name for name in ("tmp", "few", "go2")}
    for place in places.values():
        place.mkdir()
    write_swings(places["few"], 40)
    save_network(places["go2"], constant_network(robot="go2"))
    status, _, err = quadpips(*(str(argument).format(**places) for argument in arguments))
    assert status == 2
    lines = [line for line in err.splitlines() if line.startswith("error:")]
    assert len(lines) == 1 and message in lines[0]
