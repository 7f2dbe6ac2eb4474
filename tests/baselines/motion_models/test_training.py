"""Training as a whole, on walks that are known to be linear."""

import json

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models import small_network
from quadpips_drake.baselines.motion_models.model_file import CARD, load_models
from quadpips_drake.baselines.motion_models.state import INPUTS
from quadpips_drake.baselines.motion_models.step_data import read_steps
from quadpips_drake.baselines.motion_models.training import save_training, train_models
from quadpips_drake.baselines.motion_models.variants import FILE, read_variants
from quadpips_drake.errors import UserInputError
from tests.baselines.motion_models.synthetic import STEP, linear_walk, write_data

NOISE = 0.01


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """Models of 10 noisy synthetic walks, trained and saved: (directory, TrainedModels)."""
    folder = tmp_path_factory.mktemp("training")
    write_data(folder / "data", linear_walk(), walks=10, noise=NOISE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(small_network, "EPOCHS", 15)
        told = []
        result = train_models([folder / "data"], 1, lambda *step: told.append(step))
        again = train_models([folder / "data"], 1)
    assert told[-1][1] == 15
    for first, second in zip(result.variants.network.weights, again.variants.network.weights, strict=True):
        np.testing.assert_array_equal(first, second)  # the same seed, the same bits
    save_training(folder, result)
    return folder, result


def test_what_was_trained_is_the_walk_with_its_noise(trained):
    folder, _ = trained
    models, card = load_models("anymal_c", "trot", folder), json.loads((folder / CARD).read_text())
    assert models.step_duration == STEP and models.top_speed == 1.0
    x = read_steps(folder / "data", "val").as_one_pair()[0]
    np.testing.assert_allclose(models.predict(x, 0), x @ linear_walk()[0].T, atol=NOISE)
    np.testing.assert_allclose(np.sqrt(np.diagonal(models.covariance, axis1=1, axis2=2)), NOISE, rtol=0.25)
    np.testing.assert_array_equal(models.covariance, models.covariance.swapaxes(1, 2))
    assert card["data"]["steps"] == {"train": 8 * 59, "val": 59, "test": 59}
    assert card["other_walks"]["x"]["cdm"]["rmse"] == pytest.approx(NOISE, rel=0.3)
    assert card["network_parameters"] <= 10_000


def test_more_steps_make_better_models(trained):
    curve = trained[1].curve
    assert [point["steps"] for point in curve] == sorted(point["steps"] for point in curve)
    assert curve[0]["fdm"] > curve[-1]["fdm"] and curve[-1]["steps"] == 8 * 59


def test_variants_come_back_from_their_file_nearly_as_they_were(trained):
    folder, result = trained
    x = np.random.default_rng(0).uniform(-0.3, 0.3, size=(20, INPUTS))
    back = read_variants(folder).predictors()
    for name, predict in result.variants.predictors().items():
        np.testing.assert_allclose(back[name](x), predict(x), atol=5e-3, err_msg=name)


def test_damaged_variants_are_refused(trained, tmp_path):
    with pytest.raises(UserInputError, match="no such file"):
        read_variants(tmp_path)
    content = (trained[0] / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(content[: len(content) // 2])
    with pytest.raises(UserInputError, match="damaged"):
        read_variants(tmp_path)
    np.savez(tmp_path / FILE, other=np.zeros(3))
    with pytest.raises(UserInputError, match=f"{FILE} is damaged"):
        read_variants(tmp_path)


def test_data_that_do_not_belong_together_are_refused(tmp_path):
    write_data(tmp_path / "a", linear_walk())
    for name, change, words in (
        ("b", {"robot": "go2"}, "of the robot go2"),
        ("c", {"gait": "slow_trot"}, "of the gait slow_trot"),
        ("d", {"settings": {}}, "of another walk"),
        ("e", {}, "give each seed once"),
    ):
        write_data(tmp_path / name, linear_walk(), **({"seed": 2} | change if change else {}))
        with pytest.raises(UserInputError, match=words):
            train_models([tmp_path / "a", tmp_path / name], 1)
