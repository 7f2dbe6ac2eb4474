"""Files of a model: what training writes and reads, and the network as it runs against the trained one."""

import hashlib
import json
import os
import pickle
import shutil
import zipfile
from contextlib import suppress
from importlib import resources
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import torch

from quadpips_drake.errors import UserInputError
from quadpips_drake.learning.model_files import as_runnable, exported, load_network, quantized
from quadpips_drake.learning.network import NetworkConfig, SteppabilityNetwork
from quadpips_drake.perception.steppability.exported_network import INPUT, STRIDE
from quadpips_drake.perception.steppability.features import CHANNELS, make_features
from quadpips_drake.perception.steppability.model import CARD, WEIGHTS, SteppabilityModel, load_model
from tests.learning.small import DOWN_C, NETWORK, SMALL, floor_depth, save_small_model
from tests.perception.scenes import MEDIUM, camera_mount, stepping_stones, walking_poses

STEPPABILITY = "quadpips_drake.perception.steppability"


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A directory with the files of a small model, and its network."""
    directory = tmp_path_factory.mktemp("saved")
    return directory, save_small_model(directory, {"data": {"seed": 5}})


@pytest.mark.parametrize("size", [(240, 320), (48, 64), (37, 51), (1, 1)])
def test_logits_have_the_size_of_the_image(saved, size):
    with torch.inference_mode():
        assert saved[1](torch.zeros(2, len(CHANNELS), *size)).shape == (2, 3, *size)


def test_a_model_survives_its_files(saved):
    directory, network = saved
    read, card = load_network(directory)
    assert card["data"]["seed"] == 5 == load_model(directory).card["data"]["seed"]
    features = make_features(floor_depth(), DOWN_C, SMALL)
    np.testing.assert_array_equal(as_runnable(read)(features), as_runnable(network)(features))


def test_folded_logits_are_those_of_the_image(saved):
    features = make_features(floor_depth(), DOWN_C, SMALL)
    folded = as_runnable(saved[1])(features)
    with torch.inference_mode():
        whole = saved[1](torch.from_numpy(features[None]))[0].numpy()
    for i, j in np.ndindex(2, 2):
        np.testing.assert_allclose(folded.reshape(3, 2, 2, 24, 32)[:, i, j], whole[:, i::2, j::2], rtol=0, atol=1e-5)


@pytest.mark.parametrize("size", [(48, 64), (STRIDE, 3 * STRIDE)])
def test_the_exported_graph_computes_what_the_network_does(size):
    """Before it is quantised: with stride instead of folding, norms in the weights, the mean of the image on its own."""
    torch.manual_seed(1)
    network = SteppabilityNetwork(NETWORK).train()
    features = torch.randn(2, len(CHANNELS), *size)
    for _ in range(3):
        network(features)  # statistics of the norms
    network.eval()
    session = onnxruntime.InferenceSession(exported(network), providers=["CPUExecutionProvider"])
    for image in features.numpy():
        np.testing.assert_allclose(session.run(None, {INPUT: image[None]})[0][0], as_runnable(network)(image), atol=1e-4)


def test_quantising_changes_few_labels_of_the_shipped_model():
    """Of stepping stones over a pit, seen on the way."""
    with resources.as_file(resources.files(STEPPABILITY) / "weights") as weights:
        trained = SteppabilityModel(as_runnable(load_network(Path(weights))[0]))
    for _, X_WB, _ in list(walking_poses(1.2, speed=0.4, rate=2.0))[::2]:
        X_WC = X_WB @ camera_mount()
        depth = stepping_stones().depth(X_WC, MEDIUM)
        expected, labels = (model.segment(depth, -X_WC[2, :3], MEDIUM) for model in (trained, load_model()))
        assert set(np.unique(expected)) >= {1, 3}
        assert (expected == labels).mean() > 0.99


def test_the_same_weights_and_images_give_the_same_file(saved):
    images = [make_features(floor_depth(height), DOWN_C, SMALL) for height in (0.5, 0.6)]
    float32 = exported(saved[1])
    assert quantized(float32, images) == quantized(exported(saved[1]), images)


class Hostile:
    """Fails the test if reading a file runs it."""

    def __reduce__(self):
        return pytest.fail, ("a file of weights ran a program",)


def change_weights(directory, change):
    state = torch.load(directory / WEIGHTS, weights_only=True)
    torch.save(
        {key: change(value) if value.is_floating_point() else value for key, value in state.items()}, directory / WEIGHTS
    )


def flip_a_bit(directory):
    data = bytearray((directory / WEIGHTS).read_bytes())
    data[len(data) // 2] ^= 1
    (directory / WEIGHTS).write_bytes(data)


def compress(directory):
    with zipfile.ZipFile(directory / WEIGHTS) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(directory / WEIGHTS, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, part in parts.items():
            archive.writestr(name, part)


def sign(directory):
    """Makes the checksum fit again, as one would who means harm."""
    if not (directory / WEIGHTS).is_file():
        return
    with suppress(OSError, ValueError, TypeError, RecursionError):
        card = json.loads((directory / CARD).read_text())
        digest = hashlib.sha256((directory / WEIGHTS).read_bytes()).hexdigest()
        (directory / CARD).write_text(json.dumps(card | {"sha256": {WEIGHTS: digest}}))


def change_card(directory, sizes, **others):
    card = json.loads((directory / CARD).read_text())
    (directory / CARD).write_text(json.dumps(card | {"network": card["network"] | sizes} | others))


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: (d / WEIGHTS).unlink(),
        lambda d: (d / CARD).unlink(),
        lambda d: (d / CARD).write_text("nonsense"),
        lambda d: (d / CARD).write_text("[]"),
        lambda d: (d / CARD).write_text(json.dumps({"network": {"stem": -1}})),
        lambda d: (d / CARD).write_text(json.dumps({"network": {}})),
        lambda d: (d / WEIGHTS).write_bytes(b"nonsense"),
        lambda d: (d / WEIGHTS).write_bytes((d / WEIGHTS).read_bytes()[:300]),
        lambda d: torch.save([1, 2], d / WEIGHTS),
        lambda d: torch.save({"stem": 3}, d / WEIGHTS),
        lambda d: (d / WEIGHTS).write_bytes(pickle.dumps(Hostile(), protocol=2)),
        lambda d: torch.save(Hostile(), d / WEIGHTS),
        lambda d: (d / CARD).write_text("[" * 100_000),
        lambda d: (d / CARD).write_bytes(b"\xff\xfe\x00"),
        lambda d: change_weights(d, lambda tensor: tensor * np.nan),
        lambda d: change_weights(d, lambda tensor: -1.0 - tensor.abs()),
        lambda d: change_weights(d, lambda tensor: tensor.to(torch.complex64)),
        lambda d: change_weights(d, lambda tensor: tensor.to_sparse()),
        lambda d: change_weights(d, lambda tensor: tensor.int()),
        lambda d: change_weights(d, lambda tensor: tensor.flatten()[:1].expand(10**9)),
        lambda d: compress(d),
        lambda d: os.mkfifo((d / WEIGHTS).with_suffix(".fifo")) or (d / WEIGHTS).with_suffix(".fifo").replace(d / WEIGHTS),
        lambda d: ((d / CARD).unlink(), (d / CARD).mkdir()),
        lambda d: change_weights(d, lambda tensor: tensor[..., None]),
        lambda d: change_card(d, {"stem": 1000, "widths": [1000] * 3, "blocks": [32] * 3, "expansion": 1000}),
        lambda d: change_card(d, {"blocks": [1000] * 3}),
        lambda d: change_card(d, {"stem": "24"}),
        lambda d: change_card(d, {"unheard_of": 1}),
    ],
)
def test_damaged_weights_give_one_line(saved, tmp_path, damage):
    directory = shutil.copytree(saved[0], tmp_path / "model")
    damage(directory)
    sign(directory)
    with pytest.raises(UserInputError, match="quadpips train") as error:
        load_network(directory)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "damage",
    [flip_a_bit, *(lambda d, value=value: change_card(d, {}, sha256=value) for value in ("0", None, {}, {WEIGHTS: "0"}))],
)
def test_weights_that_are_not_those_of_the_card_are_refused(saved, tmp_path, damage):
    directory = shutil.copytree(saved[0], tmp_path / "model")
    damage(directory)
    with pytest.raises(UserInputError, match="SHA-256") as error:
        load_network(directory)
    assert "\n" not in str(error.value)


def test_a_file_of_weights_that_is_far_too_large_is_not_read(saved, tmp_path):
    directory = shutil.copytree(saved[0], tmp_path / "model")
    with (directory / WEIGHTS).open("r+b") as file:
        file.truncate(10**10)  # a sparse file: takes no room
    with pytest.raises(UserInputError, match="larger than 60 MB"):
        load_network(directory)


def test_bad_network_sizes_are_refused():
    with pytest.raises(UserInputError, match="stem must be"):
        NetworkConfig(stem=0)
    with pytest.raises(UserInputError, match="rates"):
        NetworkConfig(rates=(1, 2))
