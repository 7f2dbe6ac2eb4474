"""Data of walks: what counts as a step, and files that may be anything."""

import json

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.step_data import MANIFEST, join_steps, read_steps, steps_of
from quadpips_drake.errors import UserInputError
from tests.baselines.motion_models.synthetic import linear_walk, walk_rows, write_data


def test_no_step_leads_out_of_a_stumble_into_a_new_walk():
    rows = walk_rows(linear_walk(), 1, steps=10)
    rows["out_of_standing"][4] = True  # it had to stand in between
    steps = steps_of(rows)
    assert len(steps) == 8
    np.testing.assert_array_equal(steps.inputs[3], rows["inputs"][4])  # the step from row 3 to row 4 is none
    assert not len(steps_of({})) and not len(steps_of({name: array[:1] for name, array in rows.items()}))


def test_steps_of_an_odd_duration_are_left_out():
    rows = walk_rows(linear_walk(), 1, steps=20)
    rows["stamp"][10:] += 0.3
    assert len(join_steps([steps_of(rows)])) == 18


def test_splits_are_by_walk(tmp_path):
    write_data(tmp_path, linear_walk())
    parts = {name: read_steps(tmp_path, name) for name in ("train", "val", "test")}
    walks = [set(part.walk) for part in parts.values()]
    assert walks == [{0, 1, 3, 4, 6, 7}, {2}, {5}]
    assert len(read_steps(tmp_path)) == sum(len(part) for part in parts.values())


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda d: (d / MANIFEST).unlink(), "no manifest.json there"),
        (lambda d: (d / MANIFEST).write_text("{"), "not valid JSON"),
        (lambda d: (d / MANIFEST).write_text("[]"), "not data of"),
        (lambda d: write_data(d, linear_walk(), walks=8, robot=None), "incomplete"),
        (lambda d: with_walks(d, [3]), "list of walks is damaged"),
        (lambda d: (d / "walk_0003.npz").unlink(), "missing"),
        (lambda d: (d / "walk_0003.npz").write_bytes(b"PK\x03\x04" + bytes(50)), "damaged"),
        (lambda d: (d / "walk_0003.npz").write_bytes(bytes(11_000_000)), "larger than"),
        (lambda d: with_array(d, "inputs", lambda a: a * np.nan), "NaN"),
        (lambda d: with_array(d, "feet", lambda a: a[:3]), "'feet'"),
        (lambda d: with_array(d, "swing", lambda a: a + 5), "'swing'"),
        (lambda d: with_array(d, "yaw", lambda a: np.array([object()] * len(a))), "damaged"),
    ],
)
def test_unsound_data_are_refused_in_one_line(tmp_path, spoil, words):
    write_data(tmp_path, linear_walk())
    spoil(tmp_path)
    with pytest.raises(UserInputError, match=words) as refusal:
        read_steps(tmp_path)
    assert "\n" not in str(refusal.value)


def with_walks(directory, walks) -> None:
    """Replaces the list of walks in the manifest."""
    manifest = json.loads((directory / MANIFEST).read_text())
    (directory / MANIFEST).write_text(json.dumps(manifest | {"walks": walks}))


def with_array(directory, name: str, change) -> None:
    """Writes walk 3 anew with one array changed."""
    rows = walk_rows(linear_walk(), 3)
    np.savez(directory / "walk_0003.npz", **(rows | {name: change(rows[name])}))


def test_too_few_walks_leave_a_split_empty(tmp_path):
    write_data(tmp_path, linear_walk(), walks=2)
    with pytest.raises(UserInputError, match="no steps in its split 'val'"):
        read_steps(tmp_path, "val")
