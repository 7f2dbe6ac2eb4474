"""The data factory: renders random scenes into a dataset of labelled depth images, with several processes.

A dataset is a directory with manifest.json and shards <split>_<number>.npz. Scene number i of a dataset depends on the
dataset's seed, on i and on the configuration alone: workers and interruptions change nothing.
"""

import dataclasses
import os
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json, write_json
from quadpips_drake.learning.camera_path import camera_poses
from quadpips_drake.learning.dataset import DEPTH_UNIT, MANIFEST, VERSION
from quadpips_drake.learning.dataset_config import SPLITS, DatasetConfig, split_of_scene
from quadpips_drake.learning.depth_corruption import corrupt_depth
from quadpips_drake.learning.scene_renderer import SceneRenderer
from quadpips_drake.learning.scenes import SCENE_KINDS, make_scene
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.worker_pool import results_of

MIN_SCENES = 10
"""Fewer scenes would leave a split empty."""


@dataclass(frozen=True)
class ShardTask:
    """One file of the dataset."""

    name: str
    split: str
    scenes: tuple[int, ...]
    """Numbers of its scenes."""


def plan_shards(frames: int, config: DatasetConfig) -> list[ShardTask]:
    """Returns the shards of a dataset of at least ``frames`` images (whole scenes).

    Raises:
        UserInputError: that are too few for three splits.
    """
    scenes = -(-frames // config.frames_per_scene)
    if scenes < MIN_SCENES:
        raise UserInputError(
            f"--frames {frames}: at least {MIN_SCENES * config.frames_per_scene} are needed for three splits"
        )
    tasks = []
    for split in SPLITS:
        numbers = [scene for scene in range(scenes) if split_of_scene(scene) == split]
        for k, first in enumerate(range(0, len(numbers), config.scenes_per_shard)):
            tasks.append(ShardTask(f"{split}_{k:04d}.npz", split, tuple(numbers[first : first + config.scenes_per_shard])))
    return tasks


def make_dataset(
    directory: Path, frames: int, seed: int, config: DatasetConfig, workers: int = 1, resume: bool = False
) -> Iterator[tuple[int, int]]:
    """Makes a dataset in ``directory``; yields (shards done, shards in all) after each shard, and once at the start.

    With ``resume`` the shards that an interrupted call with the same arguments has written are kept. A shard whose process
    died is left out, and the others are made.

    Raises:
        UserInputError: the directory holds another dataset, or one and ``resume`` is not set.
        OSError: something cannot be written.
        JobFailed: at the end, when shards are missing.
    """
    tasks = plan_shards(frames, config)
    manifest = _manifest(frames, seed, config, tasks)
    _claim_directory(Path(directory), manifest, resume)
    missing = [task for task in tasks if not (Path(directory) / task.name).is_file()]
    done = len(tasks) - len(missing)
    yield done, len(tasks)
    if not missing:
        return
    jobs = {task.name: partial(_make_shard, str(directory), task, seed, config) for task in missing}
    with closing(results_of(jobs, workers=workers, what="shards")) as made:
        for _ in made:
            done += 1
            yield done, len(tasks)


def render_scene(number: int, seed: int, config: DatasetConfig, renderer: SceneRenderer) -> dict[str, np.ndarray]:
    """Renders scene ``number`` of the dataset with that ``seed``; returns the arrays of its frames as a shard holds them."""
    rng = np.random.default_rng([seed, number])
    scene = make_scene(rng, config.policy)
    robot = load_robot(config.robots[rng.integers(len(config.robots))])
    mount = robot.camera_mounts[rng.integers(len(robot.camera_mounts))] if rng.random() < 0.3 else robot.camera()
    poses = camera_poses(
        robot,
        mount.X_BC,
        scene.start,
        scene.triangles(Steppability.STEPPABLE),
        config.frames_per_scene,
        rng,
        config.path,
    )
    renderer.show(scene)
    rows = [_render_frame(renderer, X_WC, rng, config) for X_WC in poses]
    arrays = {key: np.stack([row[key] for row in rows]) for key in rows[0]}
    count = len(rows)
    arrays["scene"] = np.full(count, number, np.int32)
    arrays["kind"] = np.full(count, list(SCENE_KINDS).index(scene.kind), np.uint8)
    return arrays


def _render_frame(renderer: SceneRenderer, X_WC: np.ndarray, rng, config: DatasetConfig) -> dict:
    depth, labels = renderer.render(X_WC)
    noisy = corrupt_depth(depth, labels, rng, config.corruption)
    down_C = -X_WC[2, :3] + config.gravity_noise * rng.standard_normal(3)
    return {
        "depth": encode_depth(noisy),
        "clean_depth": encode_depth(depth),
        "labels": labels,
        "down_C": (down_C / np.linalg.norm(down_C)).astype(np.float32),
    }


def encode_depth(depth: np.ndarray) -> np.ndarray:
    """Returns ``depth`` [m] as uint16 in steps of DEPTH_UNIT; what is not finite or not positive becomes 0."""
    with np.errstate(invalid="ignore"):
        steps = np.where(np.isfinite(depth) & (depth > 0), np.round(depth / DEPTH_UNIT), 0)
    return np.clip(steps, 0, 65535).astype(np.uint16)


def _make_shard(directory: str, task: ShardTask, seed: int, config: DatasetConfig) -> None:
    renderer = _renderer(config)
    scenes = [render_scene(number, seed, config, renderer) for number in task.scenes]
    arrays = {key: np.concatenate([scene[key] for scene in scenes]) for key in scenes[0]}
    # Written under another name first, so that an interruption leaves no half shard behind.
    unfinished = Path(directory) / f".{task.name}.{os.getpid()}"
    try:
        with unfinished.open("wb") as file:
            np.savez_compressed(file, **arrays)
        unfinished.rename(Path(directory) / task.name)
    except OSError:
        unfinished.unlink(missing_ok=True)
        raise


_worker_renderer: list[SceneRenderer] = []


def _renderer(config: DatasetConfig) -> SceneRenderer:
    """The renderer of this worker process, made once: an EGL context is slow to make."""
    if not _worker_renderer:
        _worker_renderer.append(SceneRenderer(config.camera))
    return _worker_renderer[0]


def _manifest(frames: int, seed: int, config: DatasetConfig, tasks: list[ShardTask]) -> dict:
    shards = [
        {"file": task.name, "split": task.split, "scenes": len(task.scenes)}
        | {"frames": len(task.scenes) * config.frames_per_scene}
        for task in tasks
    ]
    return {
        "format": "quadpips steppability dataset",
        "version": VERSION,
        "seed": seed,
        "frames": sum(shard["frames"] for shard in shards),
        "scene_kinds": list(SCENE_KINDS),
        "labels": {label.name.lower(): int(label) for label in Steppability},
        "depth_unit": DEPTH_UNIT,
        "shards": shards,
        "config": dataclasses.asdict(config),
    }


def _claim_directory(directory: Path, manifest: dict, resume: bool) -> None:
    path = directory / MANIFEST
    if path.is_file():
        if not resume:
            raise UserInputError(f"--out {directory}: holds a dataset already; add --resume, or give another directory")
        try:
            same = read_json(path) == manifest
        except UserInputError:
            same = False
        if not same:
            raise UserInputError(f"--resume: {directory} was made with other --frames, --seed or settings")
    elif any((directory / shard["file"]).exists() for shard in manifest["shards"]):
        raise UserInputError(f"--out {directory}: holds shards without a {MANIFEST}; give another directory")
    for leftover in directory.glob(".*.npz.*"):
        leftover.unlink()
    write_json(path, manifest)
