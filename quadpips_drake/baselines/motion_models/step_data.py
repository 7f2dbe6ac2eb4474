"""Steps that were taken down: what went in, what came out; read from a directory that 'motion-models collect' has made."""

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.state import (
    INPUTS,
    OUTPUTS,
    StepState,
    measured_outputs,
    mirrored_inputs,
    mirrored_outputs,
)
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json

MANIFEST, FORMAT, VERSION = "manifest.json", "quadpips motion model data", 1
ROWS = {
    "stamp": (),
    "swing": (),
    "position": (2,),
    "yaw": (),
    "velocity": (2,),
    "feet": (4, 2),
    "inputs": (INPUTS,),
    "out_of_standing": (),
}
"""Arrays of a walk's file, one row for each exchange of the feet, and the shape of a row."""
DURATION_TOLERANCE = 0.5
"""Steps whose duration differs by more than this part from the median are left out: a foot was not felt, or stumbled."""
MAX_WALK_BYTES = 10_000_000
ADVICE = "make it anew with 'quadpips motion-models collect'"
_REPAIR = "delete it and run 'quadpips motion-models collect ... --resume'"


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps of one or several walks."""

    inputs: np.ndarray
    """(n, INPUTS), see ``state``."""
    outputs: np.ndarray
    """(n, OUTPUTS)"""
    swing: np.ndarray
    """Which pair swung, (n,)."""
    walk: np.ndarray
    """Number of the walk, (n,)."""
    duration: np.ndarray
    """[s], (n,)"""

    def __len__(self) -> int:
        return len(self.inputs)

    def chosen(self, which: np.ndarray) -> "Steps":
        """Some of them, by index or mask."""
        return Steps(*(getattr(self, name)[which] for name in ("inputs", "outputs", "swing", "walk", "duration")))

    def as_one_pair(self) -> tuple[np.ndarray, np.ndarray]:
        """Inputs and outputs as if swing 0 had done them all: those of the other one as a mirror shows them."""
        other = (self.swing == 1)[:, None]
        return (
            np.where(other, mirrored_inputs(self.inputs), self.inputs),
            np.where(other, mirrored_outputs(self.outputs), self.outputs),
        )


def steps_of(rows: dict[str, np.ndarray], walk: int = 0) -> Steps:
    """The steps between the ``rows`` of a walk, see ROWS; a last step that was not finished is none."""
    kept = [i for i in range(len(rows.get("stamp", ())) - 1) if not rows["out_of_standing"][i + 1]]
    states = {i: _state(rows, i) for first in kept for i in (first, first + 1)}
    outputs = [measured_outputs(states[i], states[i + 1]) for i in kept]
    duration = np.array([rows["stamp"][i + 1] - rows["stamp"][i] for i in kept])
    return Steps(
        rows["inputs"][kept] if kept else np.empty((0, INPUTS)),
        np.array(outputs).reshape(-1, OUTPUTS),
        rows["swing"][kept].astype(int) if kept else np.empty(0, int),
        np.full(len(kept), walk),
        duration,
    )


def join_steps(parts: list[Steps]) -> Steps:
    """All of them, one after the other, without those of an odd duration."""
    names = ("inputs", "outputs", "swing", "walk", "duration")
    steps = Steps(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
    median = np.median(steps.duration) if len(steps) else 0.0
    return steps.chosen(np.abs(steps.duration - median) <= DURATION_TOLERANCE * median)


def read_manifest_of(directory: Path) -> dict:
    """The manifest of a dataset; UserInputError where there is none, or it is not one of this version."""
    path = Path(directory) / MANIFEST
    if not path.exists():
        raise UserInputError(f"--data {directory}: no {MANIFEST} there; make data with 'quadpips motion-models collect'")
    manifest = read_json(path)
    wanted = {"robot": str, "gait": str, "seed": int, "settings": dict, "walks": list, "top_speed": float}
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT or manifest.get("version") != VERSION:
        raise UserInputError(f"{path}: not data of '{FORMAT}', version {VERSION}; {ADVICE}")
    if not all(isinstance(manifest.get(key), kind) for key, kind in wanted.items()):
        raise UserInputError(f"{path}: incomplete; {ADVICE}")
    sound = (isinstance(walk, dict) and {"file", "split"} <= walk.keys() for walk in manifest["walks"])
    if not all(sound):
        raise UserInputError(f"{path}: its list of walks is damaged; {ADVICE}")
    return manifest


def read_steps(directory: Path, split: str | None = None, *, may_be_empty: bool = False) -> Steps:
    """Reads all steps of a split (train, val, test), or of all of them.

    Raises:
        UserInputError: something is missing or damaged, holds NaN, or there is nothing (unless that ``may_be`` so).
    """
    manifest, parts = read_manifest_of(directory), []
    for number, walk in enumerate(manifest["walks"]):
        if split in (None, walk["split"]):
            parts.append(steps_of(read_rows(Path(directory) / str(walk["file"])), number))
    steps = join_steps(parts or [steps_of({})])
    if not len(steps) and not may_be_empty:
        raise UserInputError(f"--data {directory}: no steps in its split '{split or 'all'}'; collect more minutes")
    return steps


def read_rows(path: Path) -> dict[str, np.ndarray]:
    """Reads the rows of one walk; UserInputError where they are missing, damaged or not finite."""
    try:
        if path.stat().st_size > MAX_WALK_BYTES:
            raise OverflowError
        with np.load(path, allow_pickle=False) as file:
            rows = {name: file[name] for name in ROWS if name in file}
    except FileNotFoundError:
        raise UserInputError(f"{path}: missing; run 'quadpips motion-models collect ... --resume'") from None
    except OverflowError:
        raise UserInputError(f"{path}: larger than {MAX_WALK_BYTES / 1e6:g} MB") from None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, NotImplementedError, MemoryError):
        raise UserInputError(f"{path}: damaged; {_REPAIR}") from None
    if not rows:
        return rows  # of a walk that fell at once
    count = len(rows.get("stamp", ()))
    for name, shape in ROWS.items():
        if name not in rows or rows[name].shape != (count, *shape) or rows[name].dtype.kind not in "fiub":
            raise UserInputError(f"{path}: damaged ('{name}'); {_REPAIR}")
        if not np.isfinite(rows[name]).all():
            raise UserInputError(f"{path}: '{name}' holds NaN or infinity; {_REPAIR}")
    if not np.isin(rows["swing"], (0, 1)).all():
        raise UserInputError(f"{path}: damaged ('swing'); {_REPAIR}")
    return rows


def _state(rows: dict, i: int) -> StepState:
    nothing = np.zeros(2), np.zeros(3)
    position, yaw, velocity, feet = (rows[name][i] for name in ("position", "yaw", "velocity", "feet"))
    return StepState(position, float(yaw), velocity, *nothing, feet, int(rows["swing"][i]))
