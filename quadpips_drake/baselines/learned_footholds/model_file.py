"""Files of the network of footholds: an .npz with arrays and a JSON card; reading them executes nothing they contain."""

import hashlib
import io
import math
from importlib import resources
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.learned_footholds.network import SHAPES, FootholdNetwork
from quadpips_drake.baselines.motion_models.model_file import arrays_in
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_bytes, read_json, write_bytes, write_json

WEIGHTS, CARD = "footholds.npz", "footholds.json"
"""Names of the two files, in one directory."""
FORMAT, VERSION = "quadpips learned footholds", 1
MAX_BYTES = 200_000
"""Larger files are not read."""
_ARRAY_BYTES = 100_000
ADVICE = "give a directory that 'quadpips learned-footholds train' has written"


def save_network(directory: Path, network: FootholdNetwork, more: dict | None = None) -> None:
    """Writes both files into ``directory``; ``more`` goes into the card: where the network comes from, and its figures."""
    file = io.BytesIO()
    np.savez(file, **{name: getattr(network, name).astype(np.float32) for name in SHAPES})
    content = file.getvalue()
    write_bytes(Path(directory) / WEIGHTS, content)
    card = {"format": FORMAT, "version": VERSION, "robot": network.robot, "cell": network.cell}
    write_json(Path(directory) / CARD, {**card, "sha256": hashlib.sha256(content).hexdigest(), **(more or {})})


def load_network(robot: str, directory: Path | None = None) -> FootholdNetwork:
    """Reads the network of ``robot`` from ``directory``, by default the one that comes with the package.

    Raises:
        UserInputError: it is missing, damaged, too large, not finite, or of another robot.
    """
    if directory is None:
        shipped = sorted(path.parent.name for path in _weights().glob(f"*/{CARD}"))
        if robot not in shipped:
            raise UserInputError(
                f"no learned footholds of {robot} come with the package (but: {', '.join(shipped) or 'none'}); "
                "make some with 'quadpips learned-footholds collect' and 'train'"
            )
        directory = _weights() / robot
    try:
        network = _read(Path(directory))
        if network.robot != robot:
            raise UserInputError(f"they are of the robot {network.robot}, not {robot}")
    except UserInputError as error:
        raise UserInputError(f"learned footholds {directory}: {error}; {ADVICE}") from None
    return network


def _weights() -> Path:
    return Path(str(resources.files("quadpips_drake.baselines.learned_footholds"))) / "weights"


def _read(directory: Path) -> FootholdNetwork:
    card = read_json(directory / CARD, CARD, MAX_BYTES)
    content = read_bytes(directory / WEIGHTS, WEIGHTS, MAX_BYTES)
    if not isinstance(card, dict) or card.get("format") != FORMAT or card.get("version") != VERSION:
        raise UserInputError(f"{CARD} is no card of {FORMAT}, version {VERSION}")
    if card.get("sha256") != hashlib.sha256(content).hexdigest():
        raise UserInputError(f"{WEIGHTS} is not the file that {CARD} was written for: its SHA-256 is another one")
    robot, cell = card.get("robot"), card.get("cell")
    if not isinstance(robot, str) or not isinstance(cell, float) or not (math.isfinite(cell) and 0.0 < cell < 1.0):
        raise UserInputError(f"{CARD} lacks a sound 'robot' or 'cell'")
    arrays = arrays_in(content, WEIGHTS, _ARRAY_BYTES)
    for name, shape in SHAPES.items():
        if name not in arrays or arrays[name].shape != shape or arrays[name].dtype != np.float32:
            raise UserInputError(f"{WEIGHTS}: '{name}' must be float32 {shape}")
    if not (arrays["scale"] > 0.0).all():
        raise UserInputError(f"{WEIGHTS}: 'scale' must be positive")
    return FootholdNetwork(robot, cell, **{name: arrays[name].astype(float) for name in SHAPES})
