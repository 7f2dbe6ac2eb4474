"""The trained network as a function from depth to labels, and its files."""

import dataclasses
import pickle
import zipfile
from contextlib import contextmanager
from importlib import resources
from pathlib import Path

import numpy as np
import torch

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json, write_json
from quadpips_drake.perception.steppability.features import MAX_DEPTH, make_features, scaled_intrinsics
from quadpips_drake.perception.steppability.network import NetworkConfig, SteppabilityNetwork
from quadpips_drake.values.camera_intrinsics import CameraIntrinsics
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
    """Writes weights and card into ``directory``; the configuration of the network goes into the card."""
    state = {key: value.detach().cpu().contiguous() for key, value in network.state_dict().items()}
    torch.save(state, Path(directory) / WEIGHTS)
    write_json(Path(directory) / CARD, {"network": dataclasses.asdict(network.config)} | card)


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


def _read_network(config: NetworkConfig, path: Path) -> SteppabilityNetwork:
    """Returns a network with the weights in ``path``; ValueError and others of _DAMAGE if they are not sound."""
    if path.stat().st_size > _MAX_BYTES:
        raise ValueError("too large")
    # Without memory of its own until the weights are there: a card can name a network that no machine can hold.
    with torch.device("meta"):
        network = SteppabilityNetwork(config)
    state = torch.load(path, weights_only=True, map_location="cpu")
    # A NaN would be the largest logit and make its class, steppable, of everything.
    if not all(torch.isfinite(tensor).all() for tensor in state.values()):
        raise ValueError("not finite")
    state = {key: tensor.float() if tensor.is_floating_point() else tensor for key, tensor in state.items()}
    network.load_state_dict(state, assign=True)
    return network


def _read_model(directory: Path) -> SteppabilityModel:
    advice = "give a directory that 'quadpips train' has written"
    try:
        card = read_json(directory / CARD)
        network = _read_network(NetworkConfig(**card["network"]), directory / WEIGHTS)
    except OSError as error:
        missing = Path(error.filename or directory).name
        raise UserInputError(f"model {directory}: cannot read {missing}; {advice}") from None
    except UserInputError as error:
        raise UserInputError(f"model {directory}: {error}; {advice}") from None
    except _DAMAGE:
        raise UserInputError(f"model {directory}: {CARD} and {WEIGHTS} are damaged or do not fit; {advice}") from None
    return SteppabilityModel(network, card)
