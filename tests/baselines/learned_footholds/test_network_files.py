"""Files of the network: what is written is read; what is not sound is refused in one line."""

import hashlib
import io
import json

import numpy as np
import pytest

from quadpips_drake.baselines.learned_footholds.model_file import CARD, WEIGHTS, load_network, save_network
from quadpips_drake.baselines.learned_footholds.network import SHAPES
from quadpips_drake.baselines.learned_footholds.swing_view import INPUTS, patch_cell
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from tests.baselines.learned_footholds.made_up import constant_network

SHIPPED = ("anymal_c",)


def test_what_is_written_is_read(tmp_path):
    network = constant_network((0.1, -0.02))
    save_network(tmp_path, network, {"seed": 3})
    again = load_network("anymal_c", tmp_path)
    inputs = np.random.default_rng(0).standard_normal((5, INPUTS))
    assert np.array_equal(again.offsets(inputs), network.offsets(inputs))
    np.testing.assert_allclose(again.offsets(inputs), np.tile([0.1, -0.02], (5, 1)), atol=1e-7)
    assert json.loads((tmp_path / CARD).read_text())["seed"] == 3


def rewritten(directory, change):
    """Writes the arrays anew after ``change``, with a card that fits."""
    with np.load(directory / WEIGHTS) as file:
        arrays = {name: file[name] for name in file.files}
    change(arrays)
    content = io.BytesIO()
    np.savez(content, **arrays)
    (directory / WEIGHTS).write_bytes(content.getvalue())
    card = json.loads((directory / CARD).read_text())
    card["sha256"] = hashlib.sha256(content.getvalue()).hexdigest()
    (directory / CARD).write_text(json.dumps(card))


def changed_card(directory, **changes):
    card = json.loads((directory / CARD).read_text()) | changes
    (directory / CARD).write_text(json.dumps(card))


DAMAGES = {
    "another robot": (lambda d: changed_card(d, robot="go2"), "of the robot go2, not anymal_c"),
    "another version": (lambda d: changed_card(d, version=99), "version 1"),
    "no cell": (lambda d: changed_card(d, cell=None), "'cell'"),
    "an endless cell": (lambda d: changed_card(d, cell=float("inf")), "'cell'"),
    "no card": (lambda d: (d / CARD).unlink(), CARD),
    "no weights": (lambda d: (d / WEIGHTS).unlink(), WEIGHTS),
    "cut off": (lambda d: (d / WEIGHTS).write_bytes((d / WEIGHTS).read_bytes()[:-100]), "SHA-256"),
    "too large": (lambda d: (d / WEIGHTS).write_bytes(bytes(300_000)), WEIGHTS),
    "not finite": (lambda d: rewritten(d, lambda a: a["bias_2"].fill(np.nan)), "'bias_2'"),
    "of another shape": (lambda d: rewritten(d, lambda a: a.update(bias_1=np.zeros(7, np.float32))), "'bias_1'"),
    "a layer short": (lambda d: rewritten(d, lambda a: a.pop("matrix_3")), "'matrix_3'"),
    "objects": (lambda d: rewritten(d, lambda a: a.update(mean=np.array([{}], object))), "damaged"),
    "divides by zero": (lambda d: rewritten(d, lambda a: a["scale"].fill(0.0)), "'scale'"),
    "an array that unfolds": (lambda d: rewritten(d, lambda a: a.update(more=np.zeros(40_000, np.float32))), "too large"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_not_sound_is_refused_in_one_line(damage, tmp_path):
    save_network(tmp_path, constant_network())
    harm, message = DAMAGES[damage]
    harm(tmp_path)
    with pytest.raises(UserInputError, match="learned-footholds train") as refusal:
        load_network("anymal_c", tmp_path)
    assert message in str(refusal.value) and "\n" not in str(refusal.value)


def test_a_robot_without_a_network_is_told_how_to_get_one():
    with pytest.raises(UserInputError, match=r"no learned footholds of spot .*anymal_c.*learned-footholds collect"):
        load_network("spot")


@pytest.mark.parametrize("name", SHIPPED)
def test_those_of_the_package_fit_their_robot_and_are_small(name):
    network, robot = load_network(name), load_robot(name)
    assert network.cell == pytest.approx(patch_cell(robot)) and SHAPES["mean"] == network.mean.shape
    from quadpips_drake.baselines.learned_footholds.model_file import _weights

    files = list((_weights() / name).iterdir())
    assert sum(path.stat().st_size for path in files) < 200_000
    found = json.loads((_weights() / name / CARD).read_text())["held_out"]
    assert found["network"]["mean"] < min(found["wish"]["mean"], found["nearest"]["mean"])
