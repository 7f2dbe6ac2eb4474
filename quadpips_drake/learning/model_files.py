"""Files of a model: weights in and out, and the network as it runs, quantised, made from them.

Quantisation after Jacob et al., "Quantization and Training of Neural Networks for Efficient Integer-Arithmetic-Only
Inference" (2018), by ONNX Runtime: weights are integers with a scale for each channel, activations with a scale for each
layer, which comes from the smallest and largest value that the layer has on some images. (Ranges that cut extremes off,
averages over images, made twice as much of a pit steppable.)
"""

import copy
import dataclasses
import hashlib
import io
import pickle
import tempfile
import warnings
import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import torch
from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static
from onnxruntime.quantization.shape_inference import quant_pre_process
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import write_bytes, write_json
from quadpips_drake.learning.network import AtrousPyramid, NetworkConfig, SteppabilityNetwork
from quadpips_drake.perception.steppability.exported_network import FOLD, INPUT, OUTPUT, STRIDE, padded
from quadpips_drake.perception.steppability.features import CHANNELS
from quadpips_drake.perception.steppability.model import ADVICE, CARD, EXPORTED, WEIGHTS, read_model_file

_OPSET = 17
"""Version of ONNX's operators."""
_MAX_WEIGHTS = 60_000_000
"""Larger networks are not read."""


def save_model(directory: Path, network: SteppabilityNetwork, card: dict, images: Iterable[np.ndarray]) -> None:
    """Writes all files of a model into ``directory``; the configuration of the network and checksums go into the card.

    Args:
        directory: where to.
        network: its weights.
        card: where they come from, and their figures.
        images: features (len(CHANNELS), height, width) of some images, for the ranges of activations.
    """
    network = copy.deepcopy(network).cpu().eval()
    state = {key: value.detach().contiguous() for key, value in network.state_dict().items()}
    weights = io.BytesIO()
    torch.save(state, weights)
    contents = {WEIGHTS: weights.getvalue(), EXPORTED: quantized(exported(network), images)}
    for name, content in contents.items():
        write_bytes(Path(directory) / name, content)
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}
    write_json(Path(directory) / CARD, {"network": dataclasses.asdict(network.config), "sha256": digests} | card)


def exported(network: SteppabilityNetwork) -> bytes:
    """Returns ``network`` (in evaluation mode) as an ONNX file of float32, from features to folded logits."""
    network = copy.deepcopy(network).to(memory_format=torch.contiguous_format)
    network.stem = nn.Sequential(_strided(network.stem[1]), nn.ReLU(), network.stem[2])
    network.pyramid = _SplitPyramid(network.pyramid)
    file = io.BytesIO()
    with warnings.catch_warnings():
        # Of torch's two exporters this is the older one, which needs no further packages.
        warnings.simplefilter("ignore", DeprecationWarning)
        torch.onnx.export(
            _Folded(network),
            torch.zeros(1, len(CHANNELS), 4 * STRIDE, 4 * STRIDE),
            file,
            dynamo=False,
            opset_version=_OPSET,
            input_names=[INPUT],
            output_names=[OUTPUT],
            dynamic_axes={INPUT: {2: "height", 3: "width"}, OUTPUT: {2: "rows", 3: "columns"}},
        )
    return file.getvalue()


def quantized(model: bytes, images: Iterable[np.ndarray]) -> bytes:
    """Returns the ONNX file ``model`` in 8-bit integers, with ranges of activations from features of ``images``."""
    with tempfile.TemporaryDirectory() as folder:
        given, prepared, result = (Path(folder) / f"{name}.onnx" for name in ("given", "prepared", "quantized"))
        given.write_bytes(model)
        quant_pre_process(given, prepared, skip_symbolic_shape=True)
        quantize_static(
            prepared,
            result,
            _Images(images),
            quant_format=QuantFormat.QDQ,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            per_channel=True,
            reduce_range=True,  # 7 bits of weights: sums of two products fit where a processor adds them up in 16 bits
        )
        return result.read_bytes()


def load_network(directory: Path) -> tuple[SteppabilityNetwork, dict]:
    """Reads the weights in ``directory``, to go on training from them; returns the network and its card.

    Raises:
        UserInputError: files are missing or damaged.
    """
    try:
        weights, card = read_model_file(directory, WEIGHTS)
        return _read_network(NetworkConfig(**card["network"]), weights), card
    except UserInputError as error:
        raise UserInputError(f"model {directory}: {error}; {ADVICE}") from None
    except _DAMAGE:
        raise UserInputError(f"model {directory}: {CARD} and {WEIGHTS} are damaged or do not fit; {ADVICE}") from None


def as_runnable(network: SteppabilityNetwork):
    """Returns ``network``, put into evaluation mode, as a function like ExportedNetwork: unquantised, on torch's threads."""
    network.eval()

    def logits(features: np.ndarray) -> np.ndarray:
        batch = torch.from_numpy(features[None]).to(next(network.parameters()).device, memory_format=torch.channels_last)
        with torch.inference_mode():
            return network.folded_logits(batch)[0].contiguous().cpu().numpy()

    return logits


class _Folded(nn.Module):
    """The network without folding in and out."""

    def __init__(self, network: SteppabilityNetwork):
        super().__init__()
        self.network = network

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Returns folded logits."""
        return self.network.folded_logits(features)


class _SplitPyramid(nn.Module):
    """The same as an AtrousPyramid, without spreading the mean of the image over all pixels before it is projected."""

    def __init__(self, pyramid: AtrousPyramid):
        super().__init__()
        self.branches, self.whole_image = pyramid.branches, pyramid.whole_image
        project = fuse_conv_bn_eval(*pyramid.project[:2])
        weight, outputs = project.weight.detach(), project.out_channels
        count = weight.shape[1] - self.whole_image[1].out_channels
        self.project_branches = _conv_of(weight[:, :count], project.bias.detach())
        self.project_mean = _conv_of(weight[:, count:], torch.zeros(outputs))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Returns (n, outputs, height, width)."""
        branches = self.project_branches(torch.cat([branch(x) for branch in self.branches], dim=1))
        return torch.relu(branches + self.project_mean(self.whole_image(x)))


def _strided(first: nn.Sequential) -> nn.Conv2d:
    """The first convolution on the unfolded image, with a stride; folding by itself is slow."""
    conv = fuse_conv_bn_eval(*first[:2])
    weight, size = conv.weight.detach(), conv.kernel_size[0]
    unfolded = weight.unflatten(1, (len(CHANNELS), FOLD, FOLD)).permute(0, 1, 4, 2, 5, 3)
    unfolded = unfolded.reshape(len(weight), len(CHANNELS), FOLD * size, FOLD * size)
    return _conv_of(unfolded, conv.bias.detach(), stride=FOLD, padding=FOLD * (size // 2))


def _conv_of(weight: torch.Tensor, bias: torch.Tensor, **options) -> nn.Conv2d:
    conv = nn.Conv2d(weight.shape[1], weight.shape[0], weight.shape[2:], **options)
    conv.weight.data, conv.bias.data = weight.contiguous(), bias
    return conv


class _Images(CalibrationDataReader):
    """Hands the images to the calibration one by one."""

    def __init__(self, images: Iterable[np.ndarray]):
        self._images = iter(images)

    def get_next(self) -> dict | None:
        """The next one, None after the last."""
        features = next(self._images, None)
        return None if features is None else {INPUT: padded(features)[None]}


_DAMAGE = (
    *(ValueError, LookupError, TypeError, AttributeError, RuntimeError, EOFError, MemoryError, ArithmeticError),
    *(pickle.UnpicklingError, zipfile.BadZipFile),
)
"""What torch raises at files that were damaged, or made to do damage."""


def _read_network(config: NetworkConfig, weights: bytes) -> SteppabilityNetwork:
    """Returns a network with these ``weights``; ValueError and others of _DAMAGE if they are not sound."""
    with zipfile.ZipFile(io.BytesIO(weights)) as archive:
        # What torch writes is not compressed; what is might unfold to more than there is memory.
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.infolist()):
            raise ValueError("compressed")
    # Without memory of its own until the weights are there: a card can name a network that no machine can hold.
    with torch.device("meta"):
        network = SteppabilityNetwork(config)
    state = torch.load(io.BytesIO(weights), weights_only=True, map_location="cpu")
    network.load_state_dict(_sound_state(state, network.state_dict()), assign=True)
    return network


def _sound_state(state: dict, expected: dict) -> dict:
    """Returns ``state`` with the types of the ``expected`` tensors; a ValueError if it does not fit or makes no sense."""
    if state.keys() != expected.keys() or sum(tensor.numel() for tensor in expected.values()) > _MAX_WEIGHTS:
        raise ValueError("another network")
    sound = {}
    for key, like in expected.items():
        tensor = state[key]
        same_kind = tensor.is_floating_point() == like.is_floating_point() and not tensor.is_complex()
        if tensor.shape != like.shape or not same_kind or tensor.layout != torch.strided:
            raise ValueError(f"{key} is of another kind")
        # Variances are under a root.
        if not torch.isfinite(tensor).all() or (key.endswith("running_var") and (tensor < 0).any()):
            raise ValueError(f"{key} is not finite")
        sound[key] = tensor.to(like.dtype)
    return sound
