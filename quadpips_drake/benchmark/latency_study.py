"""How long the stages compute, as latencies in a preset; and whether runs still succeed when everything takes longer."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import yaml

from quadpips_drake.benchmark.study_pool import Study, run_study
from quadpips_drake.files import write_text
from quadpips_drake.robots.stage_latencies import MEASURED, latency_layer
from quadpips_drake.trials.loading import load_config
from quadpips_drake.trials.trial import Trial

STORE = "latency.json"
"""Results, in the folder of the study."""
PERCENTILE = 95.0
"""Of a stage's computing times, which is its latency."""
CHARGED_TO = {
    "perception.normals": ("depth_noise", "self_filter", "normals"),
    "perception.steppability": ("steppability",),
    "perception.egocan": ("egocan",),
    "perception.superpixels": ("egocan_cap", "superpixels"),
    "elevation.map": ("depth_noise", "self_filter", "elevation_map"),
    "elevation.planes": ("elevation_planes",),
    "planning.torso": ("regions", "torso_search"),
    "planning.footholds": ("foothold_search",),
    "planning.swings": ("swing_optimization",),
    "heuristic.reference": ("regions", "perceptive_reference"),
    "motion_models.planner": ("foot_costmap", "command_search"),
    "tracking.mpc": ("centroidal_mpc",),
    "tracking.wbc": ("whole_body_control",),
}
"""Whose computing times (keys of timings_ms) make up the latency of a stage: what is computed when a stage reads it (the
egocan's cap, regions) is charged to its reader. Monitors and publisher take a tenth of a millisecond, and are not late."""
_ELSEWHERE = ("elevation", "heuristic", "motion_models")
"""Sections of a region source and of planners that these runs need not have: they stay as they were measured."""
_DIGITS = 4
"""Latencies are rounded to 0.1 ms."""


def measure_once(robot: str, terrain: str, seed: int) -> dict[str, list[float]]:
    """All computing times [s] of one run in which nothing is late, by stage."""
    trial = Trial(load_config(robot, terrain=terrain, seed=seed, latency="zero", threads=1))
    trial.run()
    return trial.timings.samples()


def run_measurement(robots: list[str], terrains: list[str], seeds: list[int], folder: Path, results: dict) -> Study:
    """Runs what is missing in ``results``, one after the other, so that nothing else takes computing time from them."""
    jobs = {
        f"{robot}/{terrain}/{seed}": partial(measure_once, robot, terrain, seed)
        for robot in robots
        for terrain in terrains
        for seed in seeds
    }
    missing = {key: job for key, job in jobs.items() if key not in results}
    return run_study(missing, folder / STORE, results, workers=1, description="runs")


def preset(robot: str, results: dict) -> dict:
    """Rates and latencies of the stages out of the computing times of all runs of ``robot``, keys as below ``stages``."""
    runs = [samples for key, samples in results.items() if key.split("/")[0] == robot]
    tree = latency_layer("paper", robot).data  # for the keys, and for the rates of stages that need one to be late
    for other in _ELSEWHERE:
        tree[other] = latency_layer(MEASURED, robot).data[other]
    for path, stages in CHARGED_TO.items():
        section = tree
        for name in path.split("."):
            section = section[name]
        times = [[time for run in runs for time in run.get(stage, ())] for stage in stages]
        if any(times[-1:]) or path.split(".")[0] not in _ELSEWHERE:
            section["latency"] = round(float(sum(np.percentile(t, PERCENTILE) for t in times if t)), _DIGITS)
    return tree


def write_preset(robot: str, results: dict, folder: Path) -> Path:
    """Writes latency-ROBOT.yaml into ``folder`` and returns its path."""
    runs = [key for key in results if key.split("/")[0] == robot]
    path = folder / f"latency-{robot}.yaml"
    text = yaml.safe_dump(preset(robot, results), sort_keys=False)
    head = f"# {PERCENTILE:g} % of the computing times are below these, in {len(runs)} runs of {robot} on one core [s].\n"
    write_text(path, head + text)
    return path


@dataclass(frozen=True)
class LatencySweep:
    """Runs whose latencies are those of a preset times some factors."""

    robot: str
    terrains: tuple[str, ...]
    factors: tuple[float, ...]
    seeds: tuple[int, ...]
    latency: str = "measured"
    """The preset."""

    def check(self) -> None:
        """Raises UserInputError for a factor that makes a stage later than it may be."""
        for factor in self.factors:
            load_config(self.robot, terrain=self.terrains[0], latency=self.latency, latency_scale=factor)

    def jobs(self, done: dict) -> dict:
        """What has not been done, by key: terrain/factor/seed."""
        jobs = {}
        for terrain in self.terrains:
            for factor in self.factors:
                for seed in self.seeds:
                    key = f"{terrain}/{factor:g}/{seed}"
                    if key not in done:
                        jobs[key] = partial(run_once, self.robot, terrain, self.latency, factor, seed)
        return jobs

    def run(self, folder: Path, results: dict, *, workers: int) -> Study:
        """Runs what is missing in ``results``; see ``run_study``."""
        return run_study(self.jobs(results), folder / STORE, results, workers=workers, description="runs")


def run_once(robot: str, terrain: str, latency: str, scale: float, seed: int) -> dict:
    """One run, in short."""
    trial = Trial(load_config(robot, terrain=terrain, seed=seed, latency=latency, latency_scale=scale))
    trial.run()
    result = trial.result()
    return {
        "success": result.success,
        "reason": result.reason,
        "detail": result.detail,
        "sim_time": result.sim_time,
        "replans": result.replans,
        "fallbacks": result.fallbacks,
        "footholds": result.footholds,
    }


def successes(results: dict) -> dict[str, dict[float, tuple[int, int]]]:
    """{terrain: {factor: (goals reached, runs)}}, factors in rising order."""
    counts: dict[str, dict[float, tuple[int, int]]] = {}
    for key, run in results.items():
        terrain, factor, _ = key.split("/")
        reached, runs = counts.setdefault(terrain, {}).get(float(factor), (0, 0))
        counts[terrain][float(factor)] = reached + run["success"], runs + 1
    return {terrain: dict(sorted(by_factor.items())) for terrain, by_factor in counts.items()}


def table(results: dict) -> str:
    """The results of a sweep as a markdown table: goals reached and their median time, by terrain and factor."""
    lines = ["| terrain | latencies times | goals reached | time to the goal, median [s] |", "|---|---|---|---|"]
    for terrain, by_factor in successes(results).items():
        for factor, (reached, runs) in by_factor.items():
            prefix = f"{terrain}/{factor:g}/"
            times = [run["sim_time"] for key, run in results.items() if key.startswith(prefix) and run["success"]]
            median = f"{np.median(times):.1f}" if times else "-"
            lines.append(f"| {terrain} | {factor:g} | {reached}/{runs} | {median} |")
    return "\n".join(lines)
