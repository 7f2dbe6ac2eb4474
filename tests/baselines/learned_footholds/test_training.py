"""Training: what can be learned is learned, the same with the same seed; too few or damaged data are refused."""

import json

import numpy as np
import pytest

from quadpips_drake.baselines.learned_footholds import training
from quadpips_drake.baselines.learned_footholds.model_file import load_network
from quadpips_drake.baselines.learned_footholds.swing_data import MANIFEST, ROWS, read_swings
from quadpips_drake.baselines.learned_footholds.training import save_training, train_footholds
from quadpips_drake.errors import UserInputError
from tests.baselines.learned_footholds.made_up import write_swings


@pytest.fixture(autouse=True)
def short(monkeypatch):
    monkeypatch.setattr(training, "EPOCHS", 25)


def test_it_learns_and_says_how_far_off_it_is(tmp_path):
    write_swings(tmp_path / "data", 1200)
    told = []
    trained = train_footholds(tmp_path / "data", 1, lambda *state: told.append(state))
    found = trained.card["held_out"]
    assert found["network"]["mean"] < 0.5 * found["wish"]["mean"] and found["nearest"] == found["wish"]
    assert trained.card["data"]["swings"] == {"train": 600, "val": 300, "test": 300}
    assert [epoch for epoch, _ in told] == list(range(1, 26)) and trained.epochs[-1]["val"] < trained.epochs[0]["val"]
    save_training(tmp_path, trained)
    swings, _ = read_swings(tmp_path / "data")
    kept = load_network("anymal_c", tmp_path)
    assert np.array_equal(kept.offsets(swings.inputs), trained.network.offsets(swings.inputs))


def test_the_same_seed_gives_the_same_network(tmp_path):
    write_swings(tmp_path, 480)
    first, second, other = (train_footholds(tmp_path, seed).network for seed in (1, 1, 2))
    assert np.array_equal(first.matrix_1, second.matrix_1) and not np.array_equal(first.matrix_1, other.matrix_1)


def test_too_few_swings_are_refused(tmp_path):
    write_swings(tmp_path, 300)
    with pytest.raises(UserInputError, match="150 swings are too few"):
        train_footholds(tmp_path, 1)


def spoil(directory, name, change):
    with np.load(directory / ROWS) as file:
        arrays = {key: file[key] for key in file.files}
    arrays[name] = change(arrays[name])
    with (directory / ROWS).open("wb") as file:
        np.savez(file, **arrays)


@pytest.mark.parametrize(
    ("harm", "message"),
    [
        (lambda d: (d / MANIFEST).unlink(), "no manifest.json"),
        (lambda d: (d / MANIFEST).write_text(json.dumps({"format": "other"})), "not data of"),
        (lambda d: (d / ROWS).write_bytes(b"PK"), "missing or damaged"),
        (lambda d: spoil(d, "inputs", lambda a: a * np.nan), "NaN"),
        (lambda d: spoil(d, "inputs", lambda a: a[:, 1:]), "damaged \\('inputs'\\)"),
        (lambda d: spoil(d, "walk", lambda a: a + 7), "do not belong together"),
    ],
)
def test_damaged_data_are_refused_in_one_line(harm, message, tmp_path):
    write_swings(tmp_path)
    harm(tmp_path)
    with pytest.raises(UserInputError, match=message) as refusal:
        read_swings(tmp_path)
    assert "\n" not in str(refusal.value)
