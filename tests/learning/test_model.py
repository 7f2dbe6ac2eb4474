"""The network, its files, and what it makes of any image."""

import json

import numpy as np
import pytest
import torch

from quadpips_drake.errors import UserInputError
from quadpips_drake.learning.features import CHANNELS
from quadpips_drake.learning.model import CARD, WEIGHTS, SteppabilityModel, load_model, save_model
from quadpips_drake.learning.network import NetworkConfig, SteppabilityNetwork
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
    ],
)
def test_damaged_models_give_one_line(model, tmp_path, damage):
    save_model(tmp_path, model.network, {})
    damage(tmp_path)
    with pytest.raises(UserInputError, match="quadpips train") as error:
        load_model(tmp_path)
    assert "\n" not in str(error.value)


def test_bad_network_sizes_are_refused():
    with pytest.raises(UserInputError, match="whole numbers"):
        NetworkConfig(stem=0)
    with pytest.raises(UserInputError, match="three each"):
        NetworkConfig(rates=(1, 2))


def test_the_shipped_model_knows_the_floor():
    shipped = load_model()
    intrinsics = make_intrinsics(DepthCameraConfig())
    depth = floor_depth(0.53, intrinsics)
    labels = shipped.segment(depth, DOWN_C, intrinsics)
    seen = labels > 0
    assert (labels[seen] == 1).mean() > 0.98
    assert shipped.card["data"]["seed"] >= 0 and shipped.card["val"]["mean_iou"] > 0
