"""The commands motion-models collect, train and test."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from quadpips_drake.baselines.motion_models import small_network
from quadpips_drake.baselines.motion_models.step_data import read_rows
from quadpips_drake.benchmark.motion_models import collecting, data_walk
from quadpips_drake.benchmark.motion_models.held_out import held_out_collections
from quadpips_drake.cli.main import app
from quadpips_drake.worker_pool import Outcome
from tests.baselines.motion_models.synthetic import linear_walk, walk_rows, write_data


def quadpips(*arguments):
    """Returns exit status, stdout and stderr of a command."""
    result = CliRunner().invoke(app, ["motion-models", *map(str, arguments)], prog_name="quadpips")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def walks_at_once(monkeypatch):
    """Walks are not simulated: they are linear by construction; returns the numbers of those that were walked."""
    walked = []

    def walk(collection, planned):
        walked.append(planned.number)
        return walk_rows(linear_walk(), planned.number + 10 * collection.seed, noise=0.003), "upright"

    def in_this_process(jobs, workers):
        return (Outcome(key, job()) for key, job in jobs.items())

    monkeypatch.setattr(collecting, "walk_rows", walk)
    monkeypatch.setattr("quadpips_drake.worker_pool.run_jobs", in_this_process)
    monkeypatch.setattr("quadpips_drake.benchmark.motion_models.held_out.run_jobs", in_this_process)
    for command in ("collect", "test"):
        monkeypatch.setattr(f"quadpips_drake.cli.motion_models.{command}.compile_kernels", lambda: True)
    monkeypatch.setattr(small_network, "EPOCHS", 10)
    return walked


def test_from_walks_to_figures(walks_at_once, tmp_path):
    data, model, out = (tmp_path / name for name in ("data", "model", "out"))
    status, said, _ = quadpips("collect", "--minutes", 2, "--out", data)
    assert status == 0 and "6 walks" in said and walks_at_once == [0, 1, 2, 3, 4, 5]
    (data / "walk_0003.npz").unlink()
    assert quadpips("collect", "--minutes", 2, "--out", data)[0] == 2  # holds data already
    assert quadpips("collect", "--minutes", 2, "--out", data, "--resume")[0] == 0 and walks_at_once[6:] == [3]
    status, said, _ = quadpips("train", "--data", data, "--out", model)
    assert status == 0 and "cdm:" in said
    assert {path.name for path in model.iterdir()} >= {
        "motion_models.npz",
        "motion_models.json",
        "variants.npz",
        "curves.png",
    }
    assert quadpips("train", "--data", data, "--out", model)[0] == 2  # holds results already
    status, said, _ = quadpips("test", "--model", model, "--out", out)
    assert status == 0 and "| CDM [m] |" in said and "no history" in said and "Against the paper's Table I" in said
    result = json.loads((out / "test_anymal_c_trot.json").read_text())
    assert result["walks"] == 5 and result["errors"]["cdm"]["mae"] == pytest.approx(0.003 * np.sqrt(2 / np.pi), rel=0.2)
    assert (
        result["rmse"]["full"]["fdm"]["low"] < result["rmse"]["full"]["fdm"]["value"] < result["rmse"]["full"]["fdm"]["high"]
    )
    before = len(walks_at_once)
    assert quadpips("test", "--model", model, "--out", out)[0] == 0 and len(walks_at_once) == before  # kept


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["collect", "--out", "{tmp}", "--gait", "amble"], "trot"),
        (["collect", "--out", "{tmp}", "--robot", "nobody"], "nobody"),
        (["collect", "--out", "{tmp}", "--minutes", 0], "0.01"),
        (["collect", "--out", "{tmp}", "--set", "stages.nothing=1"], "nothing"),
        (["collect", "--out", "/proc/nowhere"], "cannot write"),
        (["collect", "--out", "{data}"], "holds data already"),
        (["collect", "--out", "{data}", "--resume"], "other options"),
        (["train", "--data", "{tmp}", "--out", "{tmp}/model"], "no manifest.json"),
        (["train", "--data", "{short}", "--out", "{tmp}/model"], "too few"),
        (["test", "--model", "{tmp}"], "motion-models train"),
        (["test", "--robot", "go2", "--model", "{model}"], "of the robot anymal_c"),
        (
            ["test", "--model", "{model}", "--set", "stages.velocity_reference.max_acceleration=0.5"],
            "max_acceleration is 0.5",
        ),
        (["test", "--gait", "slow_trot"], "no motion models of anymal_c in slow_trot"),
        (["test", "--seeds", "a"], "--seeds"),
    ],
)
def test_bad_input_ends_with_one_line_and_status_2(walks_at_once, tmp_path, arguments, message):
    places = {name: tmp_path / name for name in ("tmp", "data", "short", "model")}
    places["tmp"].mkdir()
    write_data(places["data"], linear_walk(), noise=0.003)
    write_data(places["short"], linear_walk(), walks=3)
    for number in range(3):
        np.savez(places["short"] / f"walk_{number:04d}.npz", **walk_rows(linear_walk(), number, steps=12))
    if "{model}" in arguments:
        assert quadpips("train", "--data", places["data"], "--out", places["model"])[0] == 0
    status, _, err = quadpips(*(str(argument).format(**places) for argument in arguments))
    assert status == 2
    lines = [line for line in err.splitlines() if line.startswith("error:")]
    assert len(lines) == 1 and message in lines[0]


@pytest.mark.slow
def test_walks_are_the_same_with_any_number_of_workers(tmp_path):
    collection = collecting.Collection("go2", "trot", 2 * 1.2 / 60.0, 1, walk_time=1.2)
    counts = {workers: list(collecting.collect(_made(tmp_path / str(workers)), collection, workers)) for workers in (0, 2)}
    assert counts[0] == counts[2] == [(0, 2, 0), (1, 2, 0), (2, 2, 0)]
    files = {workers: sorted((tmp_path / str(workers)).iterdir()) for workers in (0, 2)}
    assert [path.read_bytes() for path in files[0]] == [path.read_bytes() for path in files[2]]
    rows = read_rows(files[0][1])
    assert len(rows["stamp"]) == 5 and rows["out_of_standing"].tolist() == [True, False, False, False, False]
    np.testing.assert_allclose(np.diff(rows["stamp"]), 0.3, atol=0.03)


def _made(folder):
    folder.mkdir()
    return folder


def test_a_walk_that_falls_is_cut_short(monkeypatch):
    rows = [{"stamp": float(k)} for k in range(10)]
    walk = data_walk.DataWalk.__new__(data_walk.DataWalk)
    walk._rows = rows
    for reason, kept in (("upright", 10), ("fell", 10 - data_walk.STEPS_BEFORE_A_FALL)):
        walk.verdict = data_walk.Verdict(reason, "")
        assert len(walk.rows()["stamp"]) == kept
    walk._rows = rows[:2]
    assert walk.rows() == {}


def test_held_out_walks_have_one_seed_each():
    collections = held_out_collections("go2", "trot", [50, 51])
    assert [c.seed for c in collections] == [50, 51] and [len(c.walks()) for c in collections] == [1, 1]
    assert collections[0].walks()[0].commands != collections[1].walks()[0].commands
