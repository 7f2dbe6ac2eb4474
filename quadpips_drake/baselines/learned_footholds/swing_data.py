"""Data of the network of footholds: one row for each swing of a leg on a plan that the foothold search found."""

import zipfile
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.learned_footholds.network import OUTPUTS
from quadpips_drake.baselines.learned_footholds.swing_view import INPUTS
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json, replacing, write_json

MANIFEST, ROWS, FORMAT, VERSION = "manifest.json", "swings.npz", "quadpips learned footholds data", 1
SPLITS = ("train", "val", "test")
MAX_BYTES = 500_000_000
ADVICE = "make it anew with 'quadpips learned-footholds collect'"


@dataclass(frozen=True, eq=False)
class Swings:
    """Swings of single legs."""

    inputs: np.ndarray
    """(n, INPUTS), see ``swing_view``."""
    offsets: np.ndarray
    """What the search chose: ahead and outward of the wish [m], (n, OUTPUTS)."""
    nearest: np.ndarray
    """The foothold nearest to the wish on any region, likewise, (n, OUTPUTS)."""
    walk: np.ndarray
    """Number of the walk, int (n,)."""

    def __len__(self) -> int:
        return len(self.inputs)

    def chosen(self, which: np.ndarray) -> "Swings":
        """Some of them, by index or mask."""
        return Swings(*(getattr(self, part.name)[which] for part in fields(self)))

    @staticmethod
    def of(rows: list[tuple]) -> "Swings":
        """Those of ``rows``, each (inputs, offset, nearest, walk)."""
        inputs, offsets, nearest, walk = zip(*rows, strict=True) if rows else ([],) * 4
        tables = (np.array(part, dtype=np.float32) for part in (inputs, offsets, nearest))
        shaped = (table.reshape(-1, width) for table, width in zip(tables, (INPUTS, OUTPUTS, OUTPUTS), strict=True))
        return Swings(*shaped, np.array(walk, dtype=np.int64))

    @staticmethod
    def joined(parts: list["Swings"]) -> "Swings":
        """Those of all ``parts``, one after the other; at least one."""
        return Swings(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Swings)))


def save_swings(directory: Path, swings: Swings, manifest: dict) -> None:
    """Writes both files; ``manifest``: robot, cell, walks with their splits, and what else there is to tell."""
    write_rows(Path(directory) / ROWS, swings)
    write_json(Path(directory) / MANIFEST, {"format": FORMAT, "version": VERSION, **manifest})


def write_rows(path: Path, swings: Swings) -> None:
    """Writes a file of rows alone, at once."""
    with replacing(path) as unfinished, unfinished.open("wb") as file:
        np.savez(file, **{part.name: getattr(swings, part.name) for part in fields(swings)})


def read_swings(directory: Path) -> tuple[Swings, dict]:
    """Reads the data in ``directory`` and their manifest; UserInputError where they are missing or not sound."""
    directory = Path(directory)
    if not (directory / MANIFEST).exists():
        raise UserInputError(f"--data {directory}: no {MANIFEST} there; make data with 'quadpips learned-footholds collect'")
    manifest = read_json(directory / MANIFEST)
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT or manifest.get("version") != VERSION:
        raise UserInputError(f"--data {directory}: not data of '{FORMAT}', version {VERSION}; {ADVICE}")
    wanted = {"robot": str, "cell": float, "seed": int, "walks": list}
    splits = [walk.get("split") for walk in manifest.get("walks", ()) if isinstance(walk, dict)]
    if not all(isinstance(manifest.get(key), kind) for key, kind in wanted.items()) or not set(splits) <= set(SPLITS):
        raise UserInputError(f"--data {directory}: {MANIFEST} is damaged; {ADVICE}")
    swings = read_rows(directory / ROWS)
    if len(splits) != len(manifest["walks"]) or not ((swings.walk >= 0) & (swings.walk < len(splits))).all():
        raise UserInputError(f"--data {directory}: {ROWS} and {MANIFEST} do not belong together; {ADVICE}")
    return swings, manifest


def split_of(swings: Swings, manifest: dict, split: str) -> Swings:
    """The swings of the walks of one split."""
    chosen = np.array([walk["split"] == split for walk in manifest["walks"]])
    return swings.chosen(chosen[swings.walk])


def read_rows(path: Path) -> Swings:
    """Reads a file of rows alone; UserInputError where it is missing or not sound."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UserInputError(f"{path}: larger than {MAX_BYTES / 1e6:g} MB")
        with np.load(path, allow_pickle=False) as file:
            swings = Swings(**{part.name: file[part.name] for part in fields(Swings)})
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, NotImplementedError, MemoryError):
        raise UserInputError(f"{path}: missing or damaged; {ADVICE}") from None
    shapes = {"inputs": (INPUTS,), "offsets": (OUTPUTS,), "nearest": (OUTPUTS,), "walk": ()}
    for name, shape in shapes.items():
        array = getattr(swings, name)
        if array.shape != (len(swings.walk), *shape) or array.dtype.kind != ("i" if name == "walk" else "f"):
            raise UserInputError(f"{path}: damaged ('{name}'); {ADVICE}")
        if not np.isfinite(array).all():
            raise UserInputError(f"{path}: '{name}' holds NaN or infinity; {ADVICE}")
    return swings
