"""What a bench runs: which robots on which terrains, with which planners, seeds and difficulties; kept in DIR/bench.yaml."""

import dataclasses
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from quadpips_drake.configuration.layers import read_layer
from quadpips_drake.configuration.loading import load_config, save_config
from quadpips_drake.configuration.schema import MAX_DURATION, MAX_SEED, configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import replacing
from quadpips_drake.terrain.suites import suite_names, suite_terrains

SETTINGS = "bench.yaml"
"""The file of the settings, in the folder of a bench."""
MAX_TRIALS = 100_000
"""Of one bench, per course, planner and difficulty."""
MAX_DIFFICULTIES = 1000
"""Of one sweep."""

OWN_KEYS = ("robot", "terrain", "planner", "seed", "difficulty", "duration")
"""Keys of a trial's configuration that a bench has other settings for."""


@configuration
class Course:
    """A robot in a world."""

    robot: str = "anymal_c"
    """Name, or path of a robot.yaml."""
    terrain: str = "flat"
    """Name in the library, or path of a terrain file."""


@configuration
class BenchSettings:
    """Everything that decides which trials a bench consists of, and what comes out of them."""

    courses: list[Course] = field(default_factory=list)
    """Which robots cross which terrains."""
    planners: list[str] = field(default_factory=lambda: ["quadpips"])
    """Names of the planners; each crosses all courses."""
    regions: str = ""
    """Where planar regions come from; empty: the planner's default."""
    difficulties: list[float] = ranged([], -1e6, 1e6, lengths=range(MAX_DIFFICULTIES + 1))
    """Of the terrains, in their own unit; empty: each terrain as it is by default."""
    trials: int = ranged(10, 1, MAX_TRIALS)
    """How often each planner crosses each course at each difficulty."""
    seed: int = ranged(0, 0, MAX_SEED)
    """Of the first trial; the following ones have the following seeds."""
    duration: float | None = ranged(None, 0.001, MAX_DURATION)
    """Longest simulated time of a trial [s]; none: that of ``quadpips run``."""
    sets: list[str] = field(default_factory=list)
    """Texts such as "stages.planning.footholds.gait=standing_walk", for all trials."""

    def __post_init__(self):
        if self.seed + self.trials - 1 > MAX_SEED:
            raise UserInputError(
                f"the last seed, {self.seed + self.trials - 1}, is beyond {MAX_SEED}; begin with a lower one"
            )
        for text in self.sets:
            if text.partition("=")[0].strip() in OWN_KEYS:
                raise UserInputError(f"--set {text}: a bench chooses that for each trial; it has options of its own for it")

    def trial_specs(self) -> list["TrialSpec"]:
        """All trials in the order in which they are run: one of each kind first, so that half a bench says half of it."""
        specs = {
            spec.key: spec
            for i in range(self.trials)
            for difficulty in self.difficulties or [None]
            for planner in self.planners
            for course in self.courses
            for spec in [TrialSpec(course.robot, course.terrain, planner, self.seed + i, difficulty)]
        }
        return list(specs.values())


@dataclass(frozen=True)
class TrialSpec:
    """One trial of a bench."""

    robot: str
    terrain: str
    planner: str
    seed: int
    difficulty: float | None = None
    """In the terrain's own unit; None: as it is by default."""

    @property
    def key(self) -> str:
        """Tells it apart from all others of its bench."""
        words = [self.robot, self.terrain, self.planner, str(self.seed)]
        return "/".join(words if self.difficulty is None else [*words, f"difficulty={self.difficulty:g}"])

    @property
    def file_name(self) -> str:
        """The key as the name of a folder."""
        return re.sub(r"[^A-Za-z0-9._=+-]+", "-", self.key).strip("-.")


def courses_of(robots: list[str], terrains: list[str]) -> list[Course]:
    """The courses of some robots over some terrains; a suite stands for the terrains that it has for each robot."""
    pairs = [
        (robot, terrain)
        for robot in robots
        for word in terrains
        for terrain in (suite_terrains(word, robot) if word in suite_names() else [word])
    ]
    return [Course(*pair) for pair in dict.fromkeys(pairs)]


def difficulties_of(text: str) -> list[float]:
    """The N values of ``LOW:HIGH:N``, evenly spaced, both ends among them; or the one that ``text`` is.

    Raises:
        UserInputError: it is not of that form.
    """
    is_one = ":" not in text
    try:
        low, high, number = (text, text, "1") if is_one else text.split(":")
        low, high, number = float(low), float(high), int(number)
        fine = np.isfinite([low, high]).all() and (is_one or (2 <= number <= MAX_DIFFICULTIES and low < high))
    except ValueError:
        fine = False
    if not fine:
        raise UserInputError(
            f"--difficulty '{text}' is no number, and not of the form LOW:HIGH:N (lower one first, 2 to {MAX_DIFFICULTIES})"
        )
    return [float(f"{value:.6g}") for value in np.linspace(low, high, number)]


def load_settings(folder: Path) -> BenchSettings | None:
    """The settings of the bench in ``folder``; None where there is none.

    Raises:
        UserInputError: they cannot be read.
    """
    path = Path(folder) / SETTINGS
    return load_config(BenchSettings, [read_layer(path)]) if path.exists() else None


def save_settings(settings: BenchSettings, folder: Path) -> None:
    """Writes the settings into ``folder``."""
    with replacing(Path(folder) / SETTINGS) as unfinished:
        save_config(settings, unfinished)


def first_difference(wanted: BenchSettings, found: BenchSettings) -> str:
    """The first setting in which two benches differ, in words; empty where they are the same."""
    for entry in dataclasses.fields(BenchSettings):
        ours, theirs = getattr(wanted, entry.name), getattr(found, entry.name)
        if ours != theirs:
            return f"{entry.name} {_shown(theirs)} there, {_shown(ours)} here"
    return ""


def _shown(value) -> str:
    if isinstance(value, list):
        words = [f"{item.robot} on {item.terrain}" if isinstance(item, Course) else f"{item}" for item in value]
        text = ", ".join(words) or "none"
        return text if len(text) <= 60 else f"{text[:57]}..."
    return "by default" if value in (None, "") else f"{value}"
