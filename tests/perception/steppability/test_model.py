"""The network, its files, and what it makes of any image."""

import hashlib
import json
import os
import pickle
import zipfile
from contextlib import suppress

import numpy as np
import pytest
import torch

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.steppability.features import CHANNELS
from quadpips_drake.perception.steppability.model import CARD, WEIGHTS, SteppabilityModel, load_model, save_model
from quadpips_drake.perception.steppability.network import NetworkConfig, SteppabilityNetwork
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, make_intrinsics
from tests.learning.small import DOWN_C, NETWORK, SMALL, floor_depth


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    return SteppabilityModel(SteppabilityNetwork(NETWORK))


@pytest.mark.parametrize("size", [(240, 320), (48, 64), (37, 51), (1, 1)])
def test_logits_have_the_size_of_the_image(model, size):
    with torch.inference_mode():
        assert model.network(torch.zeros(2, len(CHANNELS), *size)).shape == (2, 3, *size)


@pytest.mark.parametrize(
    "depth",
    [
        np.full((48, 64), np.nan),
        np.zeros((48, 64)),
        np.full((48, 64), np.inf),
        np.full((48, 64), 100.0),
        np.full((48, 64), -1.0),
        np.zeros((0, 0)),
        np.zeros((0, 64)),
    ],
)
def test_images_without_a_measurement_have_no_labels(model, depth):
    labels = model.segment(depth, DOWN_C, SMALL)
    assert labels.shape == depth.shape and labels.dtype == np.uint8
    assert not labels.any()


def test_images_of_other_sizes_and_saturated_ones_are_labelled(model):
    for shape in ((48, 64), (7, 5), (480, 640), (51, 333)):
        labels = model.segment(np.full(shape, 0.1, np.float32), DOWN_C, SMALL)
        assert labels.shape == shape
        assert labels.min() >= 1 and labels.max() <= 3


def test_only_measured_pixels_are_labelled(model):
    depth = floor_depth()
    depth[30:, 10:20] = np.nan
    labels = model.segment(depth, DOWN_C, SMALL)
    np.testing.assert_array_equal(labels > 0, np.isfinite(depth) & (depth <= 3.0))


def test_a_model_survives_its_files(model, tmp_path):
    save_model(tmp_path, model.network, {"data": {"seed": 5}})
    read = load_model(tmp_path)
    assert read.card["data"]["seed"] == 5
    depth = floor_depth()
    np.testing.assert_array_equal(read.segment(depth, DOWN_C, SMALL), model.segment(depth, DOWN_C, SMALL))


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
        (directory / CARD).write_text(json.dumps(card | {"sha256": digest}))


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
def test_damaged_models_give_one_line(model, tmp_path, damage):
    save_model(tmp_path, model.network, {})
    damage(tmp_path)
    sign(tmp_path)
    with pytest.raises(UserInputError, match="quadpips train") as error:
        load_model(tmp_path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "damage", [flip_a_bit, lambda d: change_card(d, {}, sha256="0"), lambda d: change_card(d, {}, sha256=None)]
)
def test_weights_that_are_not_those_of_the_card_are_refused(model, tmp_path, damage):
    save_model(tmp_path, model.network, {})
    damage(tmp_path)
    with pytest.raises(UserInputError, match="SHA-256") as error:
        load_model(tmp_path)
    assert "\n" not in str(error.value)


def test_a_file_of_weights_that_is_far_too_large_is_not_read(model, tmp_path):
    save_model(tmp_path, model.network, {})
    with (tmp_path / WEIGHTS).open("r+b") as file:
        file.truncate(10**10)  # a sparse file: takes no room
    with pytest.raises(UserInputError, match="larger than 60 MB"):
        load_model(tmp_path)


def test_bad_network_sizes_are_refused():
    with pytest.raises(UserInputError, match="stem must be"):
        NetworkConfig(stem=0)
    with pytest.raises(UserInputError, match="rates"):
        NetworkConfig(rates=(1, 2))


def test_the_shipped_model_knows_the_floor():
    shipped = load_model()
    intrinsics = make_intrinsics(DepthCameraConfig())
    depth = floor_depth(0.53, intrinsics)
    labels = shipped.segment(depth, DOWN_C, intrinsics)
    seen = labels > 0
    assert (labels[seen] == 1).mean() > 0.98
    assert shipped.card["data"]["seeds"][0] >= 0 and shipped.card["val"]["mean_iou"] > 0
