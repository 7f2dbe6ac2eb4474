"""Files of motion models: an .npz with arrays and a JSON card beside it; reading them executes nothing that they contain."""

import hashlib
import io
import math
import zipfile
from importlib import resources
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.models import MotionModels
from quadpips_drake.baselines.motion_models.state import INPUTS, OUTPUTS
from quadpips_drake.baselines.motion_models.walk_settings import differing_setting, settings_digest
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_bytes, read_json, write_bytes, write_json

WEIGHTS, CARD = "motion_models.npz", "motion_models.json"
"""Names of the two files, in one directory."""
FORMAT, VERSION = "quadpips motion models", 1
MAX_BYTES = 1_000_000
"""Larger files are not read."""
ADVICE = "give a directory that 'quadpips motion-models train' has written"
_SHAPES = {"coefficients": (2, OUTPUTS, INPUTS), "covariance": (2, OUTPUTS, OUTPUTS)}
_ARRAY_BYTES = 10_000
"""Larger arrays are none of these: what is compressed could unfold to more than there is memory."""


def save_models(directory: Path, models: MotionModels, more: dict | None = None) -> None:
    """Writes both files into ``directory``; ``more`` goes into the card: where the models come from, and their figures."""
    file = io.BytesIO()
    np.savez(file, **{name: getattr(models, name) for name in _SHAPES})
    content = file.getvalue()
    write_bytes(Path(directory) / WEIGHTS, content)
    card = {
        "format": FORMAT,
        "version": VERSION,
        "robot": models.robot,
        "gait": models.gait,
        "step_duration": models.step_duration,
        "top_speed": models.top_speed,
        "sha256": hashlib.sha256(content).hexdigest(),
        "walk": settings_digest(models.settings),
        **(more or {}),
        "settings": models.settings,
    }
    write_json(Path(directory) / CARD, card)


def shipped_models() -> list[tuple[str, str]]:
    """(robot, gait) of the models that come with the package."""
    return sorted((card["robot"], card["gait"]) for card in (read_json(path) for path in _weights().glob(f"*/{CARD}")))


def load_models(robot: str, gait: str, directory: Path | None = None) -> MotionModels:
    """Reads the models of ``robot`` in ``gait`` from ``directory``, by default those that come with the package.

    Raises:
        UserInputError: they are missing, damaged, too large, not finite, or of another robot or gait.
    """
    directory = model_directory(robot, gait, directory)
    models, card = read_models(directory)
    for what, wanted in (("robot", robot), ("gait", gait)):
        if card[what] != wanted:
            raise UserInputError(f"motion models {directory}: they are of the {what} {card[what]}, not {wanted}; {ADVICE}")
    return models


def model_directory(robot: str, gait: str, directory: Path | None = None) -> Path:
    """The ``directory`` itself, or where the models lie that come with the package; UserInputError where there are none."""
    if directory is not None:
        return Path(directory)
    shipped = shipped_models()
    if (robot, gait) not in shipped:
        known = ", ".join(f"{name} in {its_gait}" for name, its_gait in shipped) or "none"
        raise UserInputError(
            f"no motion models of {robot} in {gait} come with the package (but: {known}); "
            "make some with 'quadpips motion-models collect' and 'train'"
        )
    return _weights() / f"{robot}_{gait}"


def check_walk(models: MotionModels, velocity_reference, tracking) -> None:
    """Raises UserInputError if a walk with these settings is not the one that the models were learned from.

    Args: the models; VelocityReferenceConfig and TrackingConfig of the walk.
    """
    difference = differing_setting(models.settings, velocity_reference, tracking)
    if difference:
        raise UserInputError(
            f"the motion models of {models.robot} in {models.gait} are of another walk: {difference}; "
            "set it back, or collect data and train with it"
        )


def read_models(directory: Path) -> tuple[MotionModels, dict]:
    """Returns the models in ``directory`` and their card; UserInputError if they are missing or not sound."""
    try:
        card = read_json(Path(directory) / CARD, CARD, MAX_BYTES)
        content = read_bytes(Path(directory) / WEIGHTS, WEIGHTS, MAX_BYTES)
        _check_card(card, content)
        arrays = _arrays(content)
    except UserInputError as error:
        raise UserInputError(f"motion models {directory}: {error}; {ADVICE}") from None
    told = {key: card[key] for key in ("robot", "gait", "step_duration", "top_speed", "settings")}
    return MotionModels(**told, **arrays), card


def _weights() -> Path:
    return Path(str(resources.files("quadpips_drake.baselines.motion_models"))) / "weights"


def _check_card(card, content: bytes) -> None:
    if not isinstance(card, dict) or card.get("format") != FORMAT or card.get("version") != VERSION:
        raise UserInputError(f"{CARD} is no card of {FORMAT}, version {VERSION}")
    if card.get("sha256") != hashlib.sha256(content).hexdigest():
        raise UserInputError(f"{WEIGHTS} is not the file that {CARD} was written for: its SHA-256 is another one")
    kinds = {"robot": str, "gait": str, "step_duration": float, "top_speed": float, "settings": dict}
    wrong = [key for key, kind in kinds.items() if not isinstance(card.get(key), kind)]
    if wrong:
        raise UserInputError(f"{CARD} lacks a sound '{wrong[0]}'")
    for key, most in (("step_duration", 10.0), ("top_speed", 100.0)):
        if not (math.isfinite(card[key]) and 0.0 < card[key] < most):
            raise UserInputError(f"{CARD}: {key} must be a positive number below {most:g}, not {card[key]}")


def _arrays(content: bytes) -> dict[str, np.ndarray]:
    """The arrays of the .npz, checked."""
    arrays = arrays_in(content, WEIGHTS, _ARRAY_BYTES)
    for name, shape in _SHAPES.items():
        array = arrays.get(name)
        if array is None or array.shape != shape or array.dtype != np.float64:
            raise UserInputError(f"{WEIGHTS}: '{name}' must be float64 {shape}")
    return {name: np.ascontiguousarray(arrays[name]) for name in _SHAPES}


def arrays_in(content: bytes, name: str, most_bytes: int) -> dict[str, np.ndarray]:
    """The arrays in an .npz file called ``name``, each of at most ``most_bytes``; UserInputError unless all are finite."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if any(entry.file_size > most_bytes for entry in archive.infolist()):
                raise UserInputError(f"{name} holds arrays that are too large")
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {key: file[key] for key in file.files}
    except UserInputError:
        raise
    except (OSError, ValueError, LookupError, EOFError, zipfile.BadZipFile, NotImplementedError, MemoryError):
        raise UserInputError(f"{name} is damaged") from None
    for key, array in arrays.items():
        if array.dtype.kind != "f" or not np.isfinite(array).all():
            raise UserInputError(f"{name}: '{key}' holds what is no number, or not finite")
    return arrays
