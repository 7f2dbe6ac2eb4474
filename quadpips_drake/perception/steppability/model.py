"""The trained network as a function from depth to labels, and its files."""

import hashlib
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import numpy as np
from numba import njit

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_bytes, read_json
from quadpips_drake.perception.steppability.exported_network import CLASSES, FOLD, ExportedNetwork, padded
from quadpips_drake.perception.steppability.features import MAX_DEPTH, make_features, scaled_intrinsics
from quadpips_drake.values.sensing import CameraIntrinsics
from quadpips_drake.values.steppability import Steppability

WEIGHTS, EXPORTED, CARD = "steppability.pt", "steppability.onnx", "steppability.json"
"""Names of the files of a model, in one directory: weights as they were trained, the network as it runs, the model card."""
ADVICE = "give a directory that 'quadpips train' has written"
NETWORK_WIDTH = 320
"""Width of the images that the network was trained on [pixels]; wider ones are thinned out."""
_MAX_BYTES = 60_000_000
"""Larger files are not read."""
_UNKNOWN = int(Steppability.UNKNOWN)


class SteppabilityModel:
    """Runs the network on depth images."""

    def __init__(self, network: Callable[[np.ndarray], np.ndarray], card: dict | None = None):
        """``network``: from features to logits, see ExportedNetwork. ``card``: where it comes from, and its figures."""
        self.network = network
        self.card = card or {}

    def segment(self, depth: np.ndarray, down_C: np.ndarray, intrinsics: CameraIntrinsics) -> np.ndarray:
        """Returns Steppability per pixel, uint8 (height, width); UNKNOWN where nothing was measured within 3 m.

        Args:
            depth: along the optical axis [m], (height, width); NaN, inf, 0 and negative values are invalid.
            down_C: unit vector of gravity in the optical frame, (3,); the nominal one does where none is measured.
            intrinsics: of ``depth``.
        """
        if depth.size == 0:
            return np.zeros(depth.shape, np.uint8)
        with np.errstate(over="ignore"):  # beyond float32 is beyond the camera's range
            depth = np.ascontiguousarray(depth, np.float32)
        step = max(round(depth.shape[1] / NETWORK_WIDTH), 1)
        features = make_features(depth[::step, ::step], down_C, scaled_intrinsics(intrinsics, step))
        logits = self.network(padded(features))
        labels = np.empty(depth.shape, np.uint8)
        _label(logits.reshape(len(CLASSES), FOLD, FOLD, *logits.shape[1:]), depth, step, labels)
        return labels


def load_model(directory: Path | None = None) -> SteppabilityModel:
    """Reads a model from ``directory``, by default the one that comes with the package.

    Raises:
        UserInputError: files are missing or damaged.
    """
    if directory is not None:
        return _read_model(Path(directory))
    with resources.as_file(resources.files("quadpips_drake.perception.steppability") / "weights") as shipped:
        return _read_model(Path(shipped))


def read_model_file(directory: Path, name: str) -> tuple[bytes, dict]:
    """Returns the content of the file ``name`` of a model, and its card.

    Raises:
        UserInputError: one of them is missing, or the file is too large or not the one that the card was written for.
    """
    card = read_json(directory / CARD, CARD)
    content = read_bytes(directory / name, name, _MAX_BYTES)
    digests = card.get("sha256") if isinstance(card, dict) else None
    if not isinstance(digests, dict) or digests.get(name) != hashlib.sha256(content).hexdigest():
        raise UserInputError(f"{name} is not the file that {CARD} was written for: its SHA-256 is another one")
    return content, card


def _read_model(directory: Path) -> SteppabilityModel:
    try:
        content, card = read_model_file(directory, EXPORTED)
        network = ExportedNetwork(content)
    except UserInputError as error:
        raise UserInputError(f"model {directory}: {error}; {ADVICE}") from None
    except ValueError:
        raise UserInputError(f"model {directory}: {EXPORTED} is damaged or another network; {ADVICE}") from None
    return SteppabilityModel(network, card)


@njit(cache=True, nogil=True)
def _label(logits, depth, step, labels):
    """Writes the likeliest class, as Steppability, of all pixels of ``depth``, of which the network saw each ``step``-th."""
    height, width = depth.shape
    seen = np.empty(-(-width // step), np.uint8)
    for r in range(-(-height // step)):
        i, row = r % FOLD, r // FOLD
        for j in range(FOLD):
            first, second, third = logits[0, i, j, row], logits[1, i, j, row], logits[2, i, j, row]
            for c in range(j, len(seen), FOLD):
                a, b, n = first[c // FOLD], second[c // FOLD], third[c // FOLD]
                seen[c] = 1 if (a >= b) & (a >= n) else (2 if b >= n else 3)
        for v in range(r * step, min((r + 1) * step, height)):
            for u in range(width):
                measured = (depth[v, u] > 0) & (depth[v, u] <= np.float32(MAX_DEPTH))
                labels[v, u] = seen[u // step] if measured else _UNKNOWN
