"""The network as it runs: its file, and what it makes of any image."""

import hashlib
import json
import shutil
import subprocess
import sys
import threading

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.steppability.features import CHANNELS
from quadpips_drake.perception.steppability.model import CARD, EXPORTED, SteppabilityModel, load_model
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, make_intrinsics
from tests.learning.small import DOWN_C, SMALL, floor_depth


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


def test_each_pixel_has_the_class_of_the_largest_of_its_logits():
    """Three classes, 2 x 2 pixels folded into channels; the first of equal ones."""
    rng = np.random.default_rng(0)
    logits = rng.integers(-2, 3, size=(3, 48, 64)).astype(np.float32)
    folded = logits.reshape(3, 24, 2, 32, 2).transpose(0, 2, 4, 1, 3).reshape(12, 24, 32)
    labels = SteppabilityModel(lambda features: folded).segment(np.ones((48, 64)), DOWN_C, SMALL)
    np.testing.assert_array_equal(labels, logits.argmax(axis=0) + 1)


def test_of_a_wide_image_every_second_pixel_is_seen():
    rng = np.random.default_rng(0)
    logits = rng.normal(size=(3, 240, 320)).astype(np.float32)
    folded = logits.reshape(3, 120, 2, 160, 2).transpose(0, 2, 4, 1, 3).reshape(12, 120, 160)
    labels = SteppabilityModel(lambda features: folded).segment(np.ones((479, 639)), DOWN_C, SMALL)
    expected = np.kron(logits.argmax(axis=0) + 1, np.ones((2, 2)))[:479, :639]
    np.testing.assert_array_equal(labels, expected)


def test_images_in_threads_of_their_own_have_the_same_labels(model):
    depths = [floor_depth(0.4 + 0.02 * k) for k in range(8)]
    labels = [None] * len(depths)

    def segment(k):
        labels[k] = model.segment(depths[k], DOWN_C, SMALL)

    threads = [threading.Thread(target=segment, args=(k,)) for k in range(len(depths))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for depth, found in zip(depths, labels, strict=True):
        np.testing.assert_array_equal(found, model.segment(depth, DOWN_C, SMALL))


def test_nothing_that_runs_loads_torch():
    """It takes longer than everything else that a run imports."""
    code = (
        "import sys, quadpips_drake.diagrams.quadpips, quadpips_drake.trials.trial; "
        "from quadpips_drake.perception.steppability import steppability_segmenter_system as s; s.load_model(); "
        "print('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "False\n"


def change_graph(change):
    """Damage: ``change`` is done to the graph in the file."""

    def damage(directory):
        model = onnx.load(directory / EXPORTED)
        change(model.graph)
        onnx.save(model, directory / EXPORTED)

    return damage


def node(graph, operator, k=0):
    return [node for node in graph.node if node.op_type == operator][k]


def initializer(graph, name):
    return next(tensor for tensor in graph.initializer if tensor.name == name)


def set_scale(value):
    def change(graph):
        tensor = initializer(graph, node(graph, "QuantizeLinear").input[1])
        tensor.CopyFrom(numpy_helper.from_array(np.full_like(numpy_helper.to_array(tensor), value), tensor.name))

    return change


def enlarge(graph):
    """Asks for an image 10^7 times as wide."""
    scales = initializer(graph, node(graph, "Resize").input[2])
    scales.CopyFrom(numpy_helper.from_array(np.array([1, 1, 2, 1e7], np.float32), scales.name))


def pad(graph):
    """Asks for borders that no machine can hold."""
    pads = next(a for a in node(graph, "Conv").attribute if a.name == "pads")
    pads.ints[:] = [10**6] * 4


def refer(graph):
    """Wants numbers out of another file."""
    tensor = initializer(graph, node(graph, "QuantizeLinear").input[1])
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="/etc/passwd")


def loop(graph):
    """Repeats without end."""
    graph.node.append(helper.make_node("Loop", ["", ""], ["forever"], body=helper.make_graph([], "body", [], [])))


def other_output(graph):
    """Ends earlier."""
    last = graph.node[-1]
    graph.output[0].name, last.output[0] = last.input[0], "unused"


def write_identity(directory):
    kind = (TensorProto.FLOAT, [1, len(CHANNELS), "height", "width"])
    ends = [[helper.make_tensor_value_info(name, *kind)] for name in ("features", "logits")]
    same = helper.make_graph([helper.make_node("Relu", ["features"], ["logits"])], "same", *ends)
    onnx.save(helper.make_model(same, opset_imports=[helper.make_opsetid("", 17)]), directory / EXPORTED)


def sign(directory):
    """Makes the checksum fit again, as one would who means harm."""
    if (directory / EXPORTED).is_file() and (directory / CARD).is_file():
        card = json.loads((directory / CARD).read_text())
        digest = hashlib.sha256((directory / EXPORTED).read_bytes()).hexdigest()
        (directory / CARD).write_text(json.dumps(card | {"sha256": {EXPORTED: digest}}))


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: (d / EXPORTED).unlink(),
        lambda d: (d / CARD).unlink(),
        lambda d: (d / EXPORTED).write_bytes(b""),
        lambda d: (d / EXPORTED).write_bytes(b"nonsense"),
        lambda d: (d / EXPORTED).write_bytes((d / EXPORTED).read_bytes()[:3000]),
        lambda d: (d / EXPORTED).write_bytes((d / EXPORTED).read_bytes()[10:]),
        write_identity,
        change_graph(set_scale(np.nan)),
        change_graph(set_scale(np.inf)),
        change_graph(enlarge),
        change_graph(pad),
        change_graph(refer),
        change_graph(loop),
        change_graph(other_output),
        change_graph(lambda graph: setattr(node(graph, "Conv"), "domain", "elsewhere")),
        change_graph(lambda graph: graph.node.pop()),
        change_graph(lambda graph: graph.initializer.pop()),
        change_graph(lambda graph: graph.input.pop()),
        change_graph(lambda graph: setattr(graph.input[0], "name", "others")),
        change_graph(lambda graph: node(graph, "Conv", 3).input.__setitem__(0, node(graph, "Conv", 1).input[0])),
    ],
)
def test_damaged_networks_give_one_line(model_directory, tmp_path, damage):
    directory = shutil.copytree(model_directory, tmp_path / "model")
    damage(directory)
    sign(directory)
    with pytest.raises(UserInputError, match="quadpips train") as error:
        load_model(directory)
    assert "\n" not in str(error.value)


def test_a_network_that_is_not_the_one_of_the_card_is_refused(model_directory, tmp_path):
    directory = shutil.copytree(model_directory, tmp_path / "model")
    data = bytearray((directory / EXPORTED).read_bytes())
    data[len(data) // 2] ^= 1
    (directory / EXPORTED).write_bytes(data)
    with pytest.raises(UserInputError, match="SHA-256") as error:
        load_model(directory)
    assert "\n" not in str(error.value)


def test_a_file_that_is_far_too_large_is_not_read(model_directory, tmp_path):
    directory = shutil.copytree(model_directory, tmp_path / "model")
    with (directory / EXPORTED).open("r+b") as file:
        file.truncate(10**10)  # a sparse file: takes no room
    with pytest.raises(UserInputError, match="larger than 60 MB"):
        load_model(directory)


def test_the_shipped_model_knows_the_floor():
    shipped = load_model()
    intrinsics = make_intrinsics(DepthCameraConfig())
    depth = floor_depth(0.53, intrinsics)
    labels = shipped.segment(depth, DOWN_C, intrinsics)
    seen = labels > 0
    assert (labels[seen] == 1).mean() > 0.98
    assert shipped.card["data"]["seeds"][0] >= 0 and shipped.card["val"]["mean_iou"] > 0
