"""Reading what a trial has left: whatever is missing, damaged or hostile gives one clear line."""

import json
import os
import zipfile

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.reporting import reading
from quadpips_drake.trials.reporting.reading import read_log, read_record
from tests.trials.reporting.hand_made import falling, record, standing_log


@pytest.fixture
def folder(tmp_path):
    """Results of a fall, without config.yaml."""
    log = falling(standing_log(51), 0.1)
    record(log).result.save(tmp_path / "result.json")
    np.savez_compressed(tmp_path / "log.npz", **log)
    return tmp_path


def refused(folder) -> str:
    with pytest.raises(UserInputError) as caught:
        read_record(folder)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_what_was_written_is_read(folder):
    read = read_record(folder)
    assert (read.result.reason, read.result.seed, read.is_walk) == ("fell", 3, True)
    assert read.log["contact_forces"].shape == (51, 4, 3)
    assert read.robot.name == "anymal_c"
    assert read.terrain is None
    assert len(read.remarks) == 1 and "config.yaml" in read.remarks[0]
    (folder / "config.yaml").write_text("terrain: flat\n")
    read = read_record(folder)
    assert read.terrain.name == "flat" and not read.remarks
    (folder / "log.npz").unlink()
    assert read_record(folder).remarks == ("there is no log.npz",)


def test_a_log_of_an_earlier_version_says_less(folder):
    log = {name: array for name, array in standing_log(51).items() if not name.startswith(("asked", "touch", "note", "mpc"))}
    np.savez_compressed(folder / "log.npz", **log)
    assert not read_record(folder).tells_what_was_asked


def test_a_configuration_that_is_wrong_is_a_remark(folder):
    (folder / "config.yaml").write_text("terrain: /nowhere/\x41.yaml\n")
    (remark,) = read_record(folder).remarks
    assert "/nowhere" in remark
    (folder / "config.yaml").write_bytes(b"\x00\xff: [")
    assert len(read_record(folder).remarks) == 1


def test_no_results(tmp_path):
    assert "no such directory" in refused(tmp_path / "missing")
    assert "there is no result.json" in refused(tmp_path)


@pytest.mark.parametrize(
    "content",
    [
        "",
        "nonsense",
        "[]",
        "{}",
        '{"success": 1}',
        '{"success": false, "reason": "tired", "robot": "go2", "terrain": "flat"}',
        '{"success": false, "reason": "fell", "robot": ["go2"], "terrain": "flat"}',
        '{"success": false, "reason": "fell", "robot": "go2", "terrain": "flat", "timings_ms": 3}',
        "[" * 100_000,
    ],
)
def test_a_result_that_is_none(folder, content):
    (folder / "result.json").write_text(content)
    assert "result.json" in refused(folder)


def test_numbers_that_json_does_not_know_are_read(folder):
    document = json.loads((folder / "result.json").read_text())
    (folder / "result.json").write_text(json.dumps(document | {"distance_to_goal": None, "later": {"a": 1}, "sim_time": 2}))
    assert np.isnan(read_record(folder).result.distance_to_goal)


@pytest.mark.parametrize(
    "changes",
    [
        {"time": None},
        {"time": np.zeros(0)},
        {"time": np.zeros(51)},
        {"time": np.full(51, np.nan)},
        {"p_WB": np.zeros((50, 3))},
        {"p_WB": np.array(["a"] * 51)},
        {"contacts": np.zeros((51, 5))},
        {"note_time": np.zeros(3)},
        {"note_text": np.array([1.0])},
        {"foothold_leg": np.array([9]), "foothold_position": np.zeros((1, 3))}
        | {"foothold_touchdown": np.zeros(1), "foothold_plan": np.zeros(1, int)},
        {"touching_itself": np.full((51, 2), 99)},
    ],
)
def test_a_log_that_makes_no_sense(folder, changes):
    log = standing_log(51) | changes
    np.savez_compressed(folder / "log.npz", **{name: array for name, array in log.items() if array is not None})
    assert "log.npz: not a log of a trial" in refused(folder)


def test_a_log_that_is_no_log(folder, monkeypatch):
    path = folder / "log.npz"
    whole = path.read_bytes()
    for content in (b"", b"PK\x03\x04", whole[: len(whole) // 2], b"\x93NUMPY" + whole[6:]):
        path.write_bytes(content)
        assert "log.npz" in refused(folder)
    objects = standing_log(51) | {"phase": np.array([{"a": 1}] * 51, dtype=object)}
    np.savez(path, **objects)
    assert "log.npz" in refused(folder), "pickled objects are not read"
    path.write_bytes(whole)
    monkeypatch.setattr(reading, "MAX_LOG_BYTES", 1000)
    assert "larger than" in refused(folder), "a small file may unpack to a huge one"


def test_a_log_that_is_a_pipe_does_not_block(folder):
    (folder / "log.npz").unlink()
    os.mkfifo(folder / "log.npz")
    assert "not a regular file" in refused(folder)


def test_arrays_that_nobody_asked_for_are_left_alone(tmp_path):
    np.savez(tmp_path / "log.npz", **standing_log(5), surprise=np.zeros(3))
    assert "surprise" not in read_log(tmp_path / "log.npz")
    with zipfile.ZipFile(tmp_path / "log.npz", "a") as archive:
        archive.writestr("../evil.txt", "x")
    assert len(read_log(tmp_path / "log.npz")["time"]) == 5
