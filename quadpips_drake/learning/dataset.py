"""Reading a steppability dataset."""

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json
from quadpips_drake.learning.dataset_config import SPLITS
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, make_intrinsics
from quadpips_drake.values.sensing import CameraIntrinsics
from quadpips_drake.values.steppability import Steppability

MANIFEST = "manifest.json"
VERSION = 1
DEPTH_UNIT = 1e-4
"""Depth per unit of the stored integers [m]."""
_SHAPES = {"depth": 3, "clean_depth": 3, "labels": 3, "down_C": 2, "scene": 1, "kind": 1}
_KINDS = {"depth": "u", "clean_depth": "u", "labels": "u", "down_C": "f", "scene": "i", "kind": "u"}


@dataclass(frozen=True, eq=False)
class Frames:
    """Labelled depth images of one split, in memory."""

    depth: np.ndarray
    """Measured depth, uint16 (n, height, width) in DEPTH_UNIT; 0 where nothing was measured."""
    clean_depth: np.ndarray
    """The same before corruption."""
    labels: np.ndarray
    """True steppability, uint8 (n, height, width); UNKNOWN where nothing is in range."""
    down_C: np.ndarray
    """Measured direction of gravity in the optical frame, unit vectors, float32 (n, 3)."""
    scene: np.ndarray
    """Number of the scene, int32 (n,)."""
    kind: np.ndarray
    """Index into ``scene_kinds``, uint8 (n,)."""
    scene_kinds: tuple[str, ...]
    intrinsics: CameraIntrinsics
    seeds: tuple[int, ...]
    """Seeds of the datasets that the frames come from."""

    def __len__(self) -> int:
        return len(self.depth)


def decode_depth(steps: np.ndarray) -> np.ndarray:
    """Returns stored integers as depth [m], float32, NaN where nothing was measured."""
    depth = steps.astype(np.float32) * np.float32(DEPTH_UNIT)
    depth[steps == 0] = np.nan
    return depth


def read_manifest(directory: Path) -> dict:
    """Reads the manifest of a dataset.

    Raises:
        UserInputError: there is none, or it is not one of this version.
    """
    path = Path(directory) / MANIFEST
    if not path.exists():
        raise UserInputError(f"--data {directory}: no {MANIFEST} there; make a dataset with 'quadpips dataset'")
    manifest = read_json(path)
    if not isinstance(manifest, dict) or manifest.get("version") != VERSION or not isinstance(manifest.get("shards"), list):
        raise UserInputError(f"{path}: not a steppability dataset of version {VERSION}; make one with 'quadpips dataset'")
    return manifest


def load_split(directory: Path, split: str, limit: int | None = None) -> Frames:
    """Reads all frames of a split (train, val, test), or whole shards until there are ``limit`` frames.

    Raises:
        UserInputError: a shard is missing or damaged, or the split is empty.
    """
    assert split in SPLITS
    manifest = read_manifest(directory)
    try:
        camera = DepthCameraConfig(**manifest["config"]["camera"])
        names = [shard["file"] for shard in manifest["shards"] if shard["split"] == split]
        kinds, seed = tuple(manifest["scene_kinds"]), int(manifest["seed"])
    except (KeyError, TypeError, ValueError):
        raise UserInputError(
            f"{Path(directory) / MANIFEST}: incomplete; make the dataset anew with 'quadpips dataset'"
        ) from None
    intrinsics = make_intrinsics(camera)
    shards: list[dict] = []
    count = 0
    for name in names:
        if limit is not None and count >= limit:
            break
        shards.append(_read_shard(Path(directory) / str(name), intrinsics))
        count += len(shards[-1]["depth"])
    if not shards:
        raise UserInputError(f"--data {directory}: its split '{split}' is empty; make more frames with 'quadpips dataset'")
    arrays = {key: np.concatenate([shard[key] for shard in shards])[:limit] for key in _SHAPES}
    return Frames(**arrays, scene_kinds=kinds, intrinsics=intrinsics, seeds=(seed,))


def join_frames(parts: list[Frames]) -> Frames:
    """Returns the frames of several datasets, one after the other; their scenes keep their numbers.

    Raises:
        UserInputError: their cameras or kinds of scenes differ, or one dataset is there twice.
    """
    first = parts[0]
    seeds = tuple(seed for part in parts for seed in part.seeds)
    if any(part.intrinsics != first.intrinsics or part.scene_kinds != first.scene_kinds for part in parts):
        raise UserInputError("--data: the datasets have different cameras or kinds of scenes; train on those of one version")
    if len(set(seeds)) < len(seeds):
        raise UserInputError(f"--data: the datasets have seeds {', '.join(map(str, seeds))}; give each seed once")
    arrays = {key: np.concatenate([getattr(part, key) for part in parts]) for key in _SHAPES}
    return Frames(**arrays, scene_kinds=first.scene_kinds, intrinsics=first.intrinsics, seeds=seeds)


def _read_shard(path: Path, intrinsics: CameraIntrinsics) -> dict:
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {key: file[key] for key in _SHAPES}
    except FileNotFoundError:
        raise UserInputError(f"{path}: missing; complete the dataset with 'quadpips dataset ... --resume'") from None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zipfile.LargeZipFile, MemoryError):
        arrays = {}
    if not _is_sound(arrays, intrinsics):
        raise UserInputError(f"{path}: damaged; delete it and run 'quadpips dataset ... --resume'")
    return arrays


def _is_sound(arrays: dict, intrinsics: CameraIntrinsics) -> bool:
    if not arrays:
        return False
    count, size = len(arrays["scene"]), (intrinsics.height, intrinsics.width)
    for key, dimensions in _SHAPES.items():
        array = arrays[key]
        if array.ndim != dimensions or len(array) != count or array.dtype.kind != _KINDS[key]:
            return False
        if dimensions == 3 and array.shape[1:] != size:
            return False
    finite = arrays["down_C"].shape[1] == 3 and np.isfinite(arrays["down_C"]).all()
    return bool(finite and arrays["labels"].max(initial=0) <= max(Steppability))
