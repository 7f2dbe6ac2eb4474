"""Walks in several gaits, with several seeds: who stays up, and how well velocities are followed."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from quadpips_drake.benchmark.study_pool import Study, run_study
from quadpips_drake.gaits.gaits import GAITS
from quadpips_drake.trials.trial_options import resolve_config
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig

STORE = "gaits.json"
"""Results, in the folder of the study."""
FAST_TROT = {"anymal_c": 0.5, "go2": 0.4}
"""Forward [m/s]."""


@dataclass(frozen=True)
class StudiedWalk:
    """One walk of the study."""

    gait: str
    velocity: tuple[float, float, float]
    """Forward, left [m/s], turn [rad/s]."""

    @property
    def name(self) -> str:
        """For tables and keys."""
        return f"{self.gait} {','.join(f'{v:g}' for v in self.velocity)}"


def walks_of(robot: str) -> list[StudiedWalk]:
    """All gaits at 0.3 m/s, and trot forwards, sideways and turning."""
    gaits = [StudiedWalk(gait, (0.0 if gait == "stance" else 0.3, 0.0, 0.0)) for gait in GAITS]
    trots = [(FAST_TROT.get(robot, 0.4), 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.5)]
    return gaits + [StudiedWalk("trot", velocity) for velocity in trots]


def walk_once(robot: str, walk: StudiedWalk, seed: int, duration: float) -> dict:
    """One trial on flat ground, in short."""
    options = {"robot": robot, "gait": walk.gait, "velocity": list(walk.velocity), "seed": seed, "duration": duration}
    trial = WalkTrial(resolve_config(WalkTrialConfig, None, options, []))
    trial.run()
    result = trial.result()
    followed = result.walk.get("commands", [{}])[0]
    return {
        "upright": result.success,
        "detail": result.detail,
        "mean_velocity": followed.get("mean_velocity"),
        "max_tilt": result.walk.get("max_tilt"),
        "landing_error_max": result.footholds.get("landing_error_max"),
        "slipped": result.footholds.get("slipped"),
        "realtime_factor": result.realtime_factor,
        "fallbacks": result.fallbacks,
    }


def run_gaits(
    robots: list[str], seeds: list[int], folder: Path, results: dict, *, duration: float = 10.0, workers: int = 1
) -> Study:
    """Runs what is missing in ``results``, {"robot/walk/seed": trial}; see ``run_study``."""
    jobs = {}
    for robot in robots:
        for walk in walks_of(robot):
            for seed in seeds:
                key = f"{robot}/{walk.name}/{seed}"
                if key not in results:
                    jobs[key] = partial(walk_once, robot, walk, seed, duration)
    return run_study(jobs, folder / STORE, results, workers=workers, description="walks")


def table(results: dict) -> str:
    """The results as a markdown table: trials that stayed up, mean velocities, their worst error, largest tilt."""
    rows = {}
    for key, trial in results.items():
        robot, name, _ = key.split("/")
        rows.setdefault((robot, name), []).append(trial)
    lines = [
        "| robot | gait, velocity asked | upright | mean velocity | worst error | largest tilt, rad | off a foothold, mm |",
        "|---|---|---|---|---|---|---|",
    ]
    for (robot, name), trials in rows.items():
        upright = f"{sum(trial['upright'] for trial in trials)}/{len(trials)}"
        gait, velocity = name.split(" ")
        asked = np.array([float(v) for v in velocity.split(",")])
        reached = [trial["mean_velocity"] for trial in trials if trial["mean_velocity"]]
        mean = ", ".join(f"{v:.3f}" for v in np.mean(reached, axis=0) + 0.0) if reached else "-"
        error = f"{_worst_error(reached, asked):.1%}" if reached and asked.any() else "-"
        tilt = max((trial["max_tilt"] for trial in trials if trial["max_tilt"] is not None), default=float("nan"))
        landing = max((trial["landing_error_max"] or 0.0 for trial in trials), default=0.0)
        lines.append(f"| {robot} | {gait} {velocity} | {upright} | {mean} | {error} | {tilt:.2f} | {1e3 * landing:.0f} |")
    return "\n".join(lines)


def _worst_error(reached: list, asked: np.ndarray) -> float:
    """Largest error of a mean velocity in the direction that was asked for, as part of it."""
    size = np.sqrt(asked @ asked)
    return max(abs(float(np.asarray(v) @ asked) / size - size) / size for v in reached)
