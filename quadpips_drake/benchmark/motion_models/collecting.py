"""Collects the data that motion models are learned from: many walks, by several processes.

A dataset is a directory with manifest.json and one walk_<number>.npz for each walk. Walk number i depends on the dataset's
seed, length and settings and on i alone: workers and interruptions change nothing.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.step_data import FORMAT, MANIFEST, VERSION
from quadpips_drake.baselines.motion_models.walk_settings import MAX_ACCELERATION, settings_digest, walk_settings
from quadpips_drake.benchmark.motion_models.data_walk import DataWalk, longest_time
from quadpips_drake.benchmark.motion_models.walk_plan import PlannedWalk, plan_walks, speeds_up_to
from quadpips_drake.control.references.velocity_reference import VelocityWalk
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.files import read_json, write_json
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.environments.flat import flat
from quadpips_drake.terrain.environments.uneven import bumps
from quadpips_drake.trials.trial_options import resolve_config
from quadpips_drake.trials.walk_trial import WalkTrialConfig
from quadpips_drake.worker_pool import JobFailed, results_of

WALK_TIME = 20.0
"""Of the steps of one walk [s]."""
GAITS_WITH_PAIRS = ("trot", "standing_trot", "slow_trot")
"""Gaits in which diagonal pairs take turns."""
_GROUND = 200.0
"""Side of the level ground [m]."""
_BUMPS_LENGTH = 24.0
"""Of uneven ground [m]: more than a walk is long."""


@dataclass(frozen=True)
class Collection:
    """What is to be collected."""

    robot: str
    gait: str
    minutes: float
    """Walked in all [min]."""
    seed: int
    bumpy_share: float = 0.0
    """Part of the walks on uneven ground [1]."""
    bump_height: float = 0.03
    """Of that ground: columns end within so much of z = 0 [m]."""
    sets: tuple[str, ...] = ()
    """Settings of the walk, as --set texts."""
    walk_time: float = WALK_TIME
    """Of the steps of one walk [s]."""

    def __post_init__(self):
        if self.gait not in GAITS_WITH_PAIRS:
            raise unknown_name("gait with diagonal pairs", self.gait, GAITS_WITH_PAIRS)
        load_robot(self.robot)

    @property
    def step_duration(self) -> float:
        """Half a cycle of the gait [s]."""
        return 0.5 * load_gait(self.gait).duration

    @property
    def steps(self) -> int:
        """Of one walk."""
        return round(self.walk_time / self.step_duration)

    def config(self, number: int) -> WalkTrialConfig:
        """The configuration of walk ``number``."""
        options = {"robot": self.robot, "gait": self.gait, "duration": longest_time(self.steps, self.step_duration)}
        # Of a walk's random numbers none are used twice, whatever seeds two datasets have.
        options["seed"] = int(np.random.default_rng([self.seed, number]).integers(2**31))
        walk = f"stages.velocity_reference.max_acceleration={MAX_ACCELERATION}"
        return resolve_config(WalkTrialConfig, None, options, [walk, *self.sets])

    def walks(self) -> list[PlannedWalk]:
        """All its walks."""
        number, speeds = max(1, round(60.0 * self.minutes / self.walk_time)), speeds_up_to(self.top_speed)
        return plan_walks(number, self.steps, speeds, self.seed, feasible=self._legs(), bumpy_share=self.bumpy_share)

    @property
    def top_speed(self) -> float:
        """The fastest forward command in the data [m/s]: what the legs can do in the gait, or 1 m/s."""
        legs = self._legs()(np.array([10.0, 0.0, 0.0]))[0]
        return round(float(speeds_up_to(legs)[-1]), 3)

    def settings(self) -> dict:
        """Of the walk, as a model card holds them."""
        stages = self.config(0).stages
        return walk_settings(stages.velocity_reference, stages.tracking)

    def _legs(self) -> Callable[[np.ndarray], np.ndarray]:
        """Velocity (3,) -> what the legs can do of it in the gait."""
        walk, gait = VelocityWalk(load_robot(self.robot), self.config(0).stages.velocity_reference), load_gait(self.gait)
        return lambda velocity: walk.feasible(velocity, gait)


def collect(
    directory: Path, collection: Collection, workers: int = 1, resume: bool = False
) -> Iterator[tuple[int, int, int]]:
    """Collects into ``directory``; yields (walks done, walks in all, falls in this call) at first and after each walk.

    With ``resume`` the walks that an interrupted call with the same arguments has written are kept. Without ``workers`` it
    walks in this process.

    Raises:
        UserInputError: the directory holds other data, or some and ``resume`` is not set.
        OSError: something cannot be written.
        JobFailed: at the end, when walks are missing.
    """
    walks = collection.walks()
    _claim(Path(directory), _manifest(collection, walks), resume)
    missing = [walk for walk in walks if not (Path(directory) / _name(walk)).is_file()]
    done, falls = len(walks) - len(missing), 0
    yield done, len(walks), falls
    jobs = {f"walk {walk.number}": partial(_walk_into, Path(directory), collection, walk) for walk in missing}
    with closing(results_of(jobs, workers=workers, what="walks")) as reasons:
        for reason in reasons:
            done, falls = done + 1, falls + (reason != DataWalk.SUCCESS)
            yield done, len(walks), falls


def walk_rows(collection: Collection, walk: PlannedWalk) -> tuple[dict[str, np.ndarray], str]:
    """Walks; returns the rows (``step_data``) and how it ended."""
    config = collection.config(walk.number)
    if walk.bumpy:
        terrain = bumps(seed=config.seed, height=collection.bump_height, length=_BUMPS_LENGTH)
    else:
        terrain = flat(size=_GROUND)
    trial = DataWalk(config, load_robot(collection.robot), terrain, list(walk.commands))
    verdict = trial.run()
    if verdict.reason == "error":
        raise JobFailed(verdict.detail)
    return trial.rows(), verdict.reason


def _walk_into(directory: Path, collection: Collection, walk: PlannedWalk) -> str:
    rows, reason = walk_rows(collection, walk)
    # Written under another name first, so that an interruption leaves no half of one behind.
    unfinished = directory / f".{_name(walk)}.{os.getpid()}"
    try:
        with unfinished.open("wb") as file:
            np.savez(file, reason=np.array(reason), **rows)
        unfinished.rename(directory / _name(walk))
    except OSError:
        unfinished.unlink(missing_ok=True)
        raise
    return reason


def _name(walk: PlannedWalk) -> str:
    return f"walk_{walk.number:04d}.npz"


def _manifest(collection: Collection, walks: list[PlannedWalk]) -> dict:
    settings = collection.settings()
    told = {
        "format": FORMAT,
        "version": VERSION,
        **asdict(collection),
        "sets": list(collection.sets),
        "step_duration": collection.step_duration,
        "top_speed": collection.top_speed,
        "walk": settings_digest(settings),
        "settings": settings,
    }
    told["walks"] = [
        {"file": _name(walk), "split": walk.split, "bumpy": walk.bumpy, "steps": sum(c.steps for c in walk.commands)}
        for walk in walks
    ]
    return told


def _claim(directory: Path, manifest: dict, resume: bool) -> None:
    path = directory / MANIFEST
    if path.is_file():
        if not resume:
            raise UserInputError(f"--out {directory}: holds data already; add --resume, or give another directory")
        try:
            same = read_json(path) == manifest
        except UserInputError:
            same = False
        if not same:
            raise UserInputError(f"--resume: {directory} was made with other options or another walk")
    elif any((directory / walk["file"]).exists() for walk in manifest["walks"]):
        raise UserInputError(f"--out {directory}: holds walks without a {MANIFEST}; give another directory")
    for leftover in directory.glob(".walk_*.npz.*"):
        leftover.unlink()
    write_json(path, manifest)
