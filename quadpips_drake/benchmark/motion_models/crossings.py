"""Crossings of gaps and steps by velocity command: who gets over, how cleanly, and how well the way was predicted."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.model_file import load_models
from quadpips_drake.baselines.motion_models.planner.variants import VARIANTS
from quadpips_drake.benchmark.study_pool import Study, run_study
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.terrain.suites import suite_terrains
from quadpips_drake.trials.trial import Trial, TrialConfig
from quadpips_drake.trials.trial_options import resolve_config

STORE = "crossings.json"
"""Results, in the folder of the study."""
TERRAINS = suite_terrains("gaps", "anymal_c")
QUADPIPS = "quadpips"
"""The planner with regions, as a further row."""
MODELS = (*VARIANTS, QUADPIPS)
SEARCHING = ("learned", "ideal", "kinematic")
"""Those that have a horizon."""
MAPS = {"oracle": "oracle", "camera": "superpixels"}
"""The source of regions, and with it of the map, by the name of the map."""
DURATION = 40.0
"""Longest time of a crossing [s]."""
PUSH_TIME, PUSH_DURATION = 4.0, 0.1
"""When a push begins, about at the first gap, and how long it lasts [s]."""
CLEAN_DEPTH = 0.05
"""A crossing is clean if no foot was ever further below walkable ground [m]."""


@dataclass(frozen=True)
class Crossing:
    """One crossing of the study."""

    robot: str
    terrain: str
    model: str
    """One of MODELS."""
    horizon: int
    """0 where there is none."""
    map: str
    seed: int
    sets: tuple[str, ...] = ()
    """Further settings, KEY=VALUE."""
    push: float = 0.0
    """On the base, to the left in W, at PUSH_TIME [N s]."""

    @property
    def key(self) -> str:
        """Its name among the results."""
        return "/".join([*self.group, str(self.seed)])

    @property
    def group(self) -> tuple[str, ...]:
        """Crossings that differ in nothing but the seed."""
        pushed = (f"push {self.push:g}",) if self.push else ()
        return (self.robot, self.terrain, self.model, str(self.horizon), self.map, " ".join([*pushed, *self.sets]))

    def config(self) -> TrialConfig:
        """What is run."""
        options = {"robot": self.robot, "terrain": self.terrain, "seed": self.seed, "duration": DURATION}
        if self.push:
            force = [0.0, self.push / PUSH_DURATION, 0.0]
            options["pushes"] = [{"force": force, "time": PUSH_TIME, "duration": PUSH_DURATION}]
        sets = [f"stages.region_source={MAPS[self.map]}"]
        if self.model == QUADPIPS:
            return resolve_config(TrialConfig, None, {**options, "planner": QUADPIPS}, [*sets, *self.sets])
        sets.append(f"stages.motion_models.variant={self.model}")
        if self.horizon:
            sets.append(f"stages.motion_models.planner.search.horizon={self.horizon}")
        return resolve_config(TrialConfig, None, {**options, "planner": "motion_models"}, [*sets, *self.sets])


def crossings_of(
    robots: Iterable[str], terrains: Iterable[str], horizons: Iterable[int], models: Iterable[str], maps: Iterable[str],
    seeds: Iterable[int], sets: tuple[str, ...] = (), push: float = 0.0,
) -> list[Crossing]:  # fmt: skip
    """All of them, seed by seed, so that an interrupted study has some of everything."""
    return [
        Crossing(robot, terrain, model, horizon, map_, seed, sets, push)
        for seed in seeds
        for robot in robots
        for terrain in terrains
        for map_ in maps
        for model in models
        for horizon in (horizons if model in SEARCHING else (0,))
    ]


def check_models(robots: Iterable[str], models: Iterable[str], maps: Iterable[str]) -> None:
    """Raises UserInputError for what the study could not run."""
    for name in models:
        if name not in MODELS:
            raise unknown_name("model", name, MODELS)
    for name in maps:
        if name not in MAPS:
            raise unknown_name("map", name, MAPS)
    if "learned" in models:
        for robot in robots:
            load_models(robot, "trot")


def cross_once(crossing: Crossing) -> dict:
    """One crossing, in short."""
    trial = Trial(crossing.config())
    trial.run()
    result = trial.result()
    footholds = result.footholds
    return {
        "success": result.success,
        "clean": bool(result.success and footholds["deepest_m"] <= CLEAN_DEPTH),
        "reason": result.reason,
        "detail": result.detail,
        "sim_time": result.sim_time,
        "progress": result.progress[-1][1] if result.progress else 0.0,
        "touch_downs": footholds["touch_downs"],
        "unsafe": footholds["unsafe"],
        "deepest_m": footholds["deepest_m"],
        "landings": landings(trial.log.arrays()),
        "replans": result.replans,
        "fallbacks": {name: count for name, count in result.fallbacks.items() if count},
        "planning": result.planning,
        "search_ms": result.timings_ms.get("command_search", {}),
        "costmap_ms": result.timings_ms.get("foot_costmap", {}),
    }


def landings(log: dict[str, np.ndarray]) -> list[list[float]]:
    """Where feet came down on the way: leg, x, y in W [m, rounded to 1 mm] of each touch-down, of a log."""
    contacts, feet = log["contacts"], log["foot_positions"]
    samples, legs = np.nonzero(contacts[1:] & ~contacts[:-1])
    places = np.round(feet[samples + 1, legs, :2], 3)
    return [[int(leg), float(x), float(y)] for leg, (x, y) in zip(legs, places, strict=True)]


def run_crossings(crossings: list[Crossing], folder: Path, results: dict, *, workers: int = 1) -> Study:
    """Runs what is missing in ``results``, {key of a crossing: what came out}; see ``run_study``."""
    jobs = {crossing.key: partial(cross_once, crossing) for crossing in crossings if crossing.key not in results}
    return run_study(jobs, folder / STORE, results, workers=workers, description="crossings")


def known_horizons(text: str) -> list[int]:
    """The horizons of ``N,N,...``; raises UserInputError where it is not of that form, or out of range."""
    from quadpips_drake.baselines.motion_models.planner.command_search import MAX_STEPS

    try:
        horizons = [int(word) for word in text.split(",")]
    except ValueError:
        horizons = []
    if not horizons or not all(1 <= horizon <= MAX_STEPS for horizon in horizons):
        raise UserInputError(f"--horizons '{text}' is not of the form N,N,... with numbers from 1 to {MAX_STEPS}")
    return horizons
