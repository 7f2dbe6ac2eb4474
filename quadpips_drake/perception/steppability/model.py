"""The trained network as a function from depth to labels, and its files."""

import dataclasses
import hashlib
import io
import pickle
import zipfile
from contextlib import contextmanager
from importlib import resources
from pathlib import Path

import numpy as np
import torch

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_bytes, read_json, write_bytes, write_json
from quadpips_drake.perception.steppability.features import MAX_DEPTH, make_features, scaled_intrinsics
from quadpips_drake.perception.steppability.network import NetworkConfig, SteppabilityNetwork
from quadpips_drake.values.sensing import CameraIntrinsics
from quadpips_drake.values.steppability import Steppability

WEIGHTS, CARD = "steppability.pt", "steppability.json"
"""Names of the two files of a model, in one directory."""
NETWORK_WIDTH = 320
"""Width of the images that the network was trained on [pixels]; wider ones are thinned out."""
_MAX_BYTES = 60_000_000
"""Larger files of weights are not read."""


class SteppabilityModel:
    """Runs the network on depth images."""

    def __init__(self, network: SteppabilityNetwork, card: dict | None = None):
        """``card``: where the weights come from, and their figures."""
        self.network = network.eval().to(memory_format=torch.channels_last)
        self.card = card or {}

    def segment(self, depth: np.ndarray, down_C: np.ndarray, intrinsics: CameraIntrinsics) -> np.ndarray:
        """Returns Steppability per pixel, uint8 (height, width); UNKNOWN where nothing was measured within 3 m.

        Args:
            depth: along the optical axis [m], (height, width); NaN, inf, 0 and negative values are invalid.
            down_C: unit vector of gravity in the optical frame, (3,); the nominal one does where none is measured.
            intrinsics: of ``depth``.
        """
        height, width = depth.shape
        if height == 0 or width == 0:
            return np.zeros(depth.shape, np.uint8)
        step = max(round(width / NETWORK_WIDTH), 1)
        features = make_features(depth[::step, ::step], down_C, scaled_intrinsics(intrinsics, step))
        labels = self.classify(features[None])[0]
        if step > 1:
            labels = np.repeat(np.repeat(labels, step, axis=0), step, axis=1)[:height, :width]
        with np.errstate(invalid="ignore"):
            measured = (depth > 0) & (depth <= MAX_DEPTH)
        return np.where(measured, labels, Steppability.UNKNOWN).astype(np.uint8)

    def classify(self, features: np.ndarray) -> np.ndarray:
        """Returns the likeliest class of every pixel as Steppability, uint8 (n, height, width)."""
        batch = torch.from_numpy(features).to(memory_format=torch.channels_last)
        with torch.inference_mode(), _one_thread():
            return self.network(batch).argmax(dim=1).to(torch.uint8).numpy() + np.uint8(1)


@contextmanager
def _one_thread():
    """Keeps torch to the calling thread: beside a simulation, threads that wait for each other cost more than they bring."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def save_model(directory: Path, network: SteppabilityNetwork, card: dict) -> None:
    """Writes weights and card into ``directory``; the configuration of the network and a checksum go into the card."""
    state = {key: value.detach().cpu().contiguous() for key, value in network.state_dict().items()}
    weights = io.BytesIO()
    torch.save(state, weights)
    write_bytes(Path(directory) / WEIGHTS, weights.getvalue())
    own = {"network": dataclasses.asdict(network.config), "sha256": hashlib.sha256(weights.getvalue()).hexdigest()}
    write_json(Path(directory) / CARD, own | card)


def load_model(directory: Path | None = None) -> SteppabilityModel:
    """Reads a model from ``directory``, by default the one that comes with the package.

    Raises:
        UserInputError: files are missing or damaged.
    """
    if directory is None:
        with resources.as_file(resources.files("quadpips_drake.perception.steppability") / "weights") as shipped:
            return _read_model(Path(shipped))
    return _read_model(Path(directory))


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
    if state.keys() != expected.keys() or sum(tensor.numel() for tensor in expected.values()) > _MAX_BYTES:
        raise ValueError("another network")
    sound = {}
    for key, like in expected.items():
        tensor = state[key]
        same_kind = tensor.is_floating_point() == like.is_floating_point() and not tensor.is_complex()
        if tensor.shape != like.shape or not same_kind or tensor.layout != torch.strided:
            raise ValueError(f"{key} is of another kind")
        # A NaN would be the largest logit and make its class, steppable, of everything; so would the root of a variance
        # that is negative.
        if not torch.isfinite(tensor).all() or (key.endswith("running_var") and (tensor < 0).any()):
            raise ValueError(f"{key} is not finite")
        sound[key] = tensor.to(like.dtype)
    return sound


def _read_model(directory: Path) -> SteppabilityModel:
    advice = "give a directory that 'quadpips train' has written"
    try:
        card = read_json(directory / CARD, CARD)
        config = NetworkConfig(**card["network"])
        weights = read_bytes(directory / WEIGHTS, WEIGHTS, _MAX_BYTES)
        if card.get("sha256") != hashlib.sha256(weights).hexdigest():
            raise UserInputError(f"{WEIGHTS} is not the file that {CARD} was written for: its SHA-256 is another one")
        network = _read_network(config, weights)
    except UserInputError as error:
        raise UserInputError(f"model {directory}: {error}; {advice}") from None
    except _DAMAGE:
        raise UserInputError(f"model {directory}: {CARD} and {WEIGHTS} are damaged or do not fit; {advice}") from None
    return SteppabilityModel(network, card)
