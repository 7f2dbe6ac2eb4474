"""How hard a walk has to be hit before the robot falls: targets with several seeds, and the largest size by bisection."""

import math
from functools import partial
from pathlib import Path

from quadpips_drake.benchmark.disturbances import DISTURBANCES, trial_options
from quadpips_drake.benchmark.study_pool import run_study
from quadpips_drake.trials.trial_options import resolve_config
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig

STORE = "robustness.json"
"""Results, in the folder of the study."""


def survives(name: str, size: float, robot: str, folder: Path, seed: int) -> dict:
    """One trial: "survived", and what else is worth knowing."""
    options, sets = trial_options(name, size, robot, folder, seed)
    trial = WalkTrial(resolve_config(WalkTrialConfig, None, options, sets))
    trial.run()
    result = trial.result()
    return {
        "size": size,
        "seed": seed,
        "survived": result.success,
        "detail": result.detail,
        "max_tilt": result.walk.get("max_tilt"),
        "fallbacks": result.fallbacks,
    }


def study(
    name: str, robot: str, folder: Path, seeds: list[int], known: list[dict], *, bisect: bool = True, trial=survives
) -> list[dict]:
    """Trials of one disturbance with one robot: the target with each seed, then bisection with the first one.

    Args:
        known: trials that have been run before; they are not repeated.
        bisect: whether to go on until the resolution is reached.
        trial: see ``survives``.

    Returns: all trials. Bisection takes for granted that what is survived is survived in smaller sizes, too.
    """
    disturbance = DISTURBANCES[name]
    trials = list(known)

    def outcome(size: float, seed: int) -> bool:
        for done in trials:
            if done["seed"] == seed and abs(done["size"] - size) < 1e-9:
                return done["survived"]
        trials.append(trial(name, size, robot, folder, seed))
        return trials[-1]["survived"]

    low, high = disturbance.least, disturbance.largest(robot)
    size = disturbance.target[robot]
    if size > 0.0:
        for seed in seeds:
            outcome(size, seed)
    size = size or 0.5 * (low + high)
    while bisect and high - low > disturbance.resolution + 1e-9:
        low, high = (size, high) if outcome(size, seeds[0]) else (low, size)
        size = 0.5 * (low + high)
    return trials


def largest_survived(trials: list[dict]) -> float | None:
    """The largest size that was always survived, below the smallest one that was not."""
    fallen = min((trial["size"] for trial in trials if not trial["survived"]), default=math.inf)
    return max((trial["size"] for trial in trials if trial["survived"] and trial["size"] < fallen), default=None)


def _cells(trials: list[dict], target: float) -> list[str]:
    """For the table: the target, how often it was survived, the largest size survived with the first seed."""
    at_target = [trial["survived"] for trial in trials if abs(trial["size"] - target) < 1e-9]
    share = f"{sum(at_target)}/{len(at_target)}" if at_target else "-"
    one_seed = [trial for trial in trials if trial["seed"] == trials[0]["seed"]]
    best = largest_survived(one_seed)
    if best is None:
        return [f"{target:.3g}", share, "none"]
    open_end = all(trial["survived"] for trial in one_seed)
    return [f"{target:.3g}", share, f"{best:.3g}" + (" or more" if open_end else "")]


def table(results: dict) -> str:
    """The results, {"robot/disturbance": trials}, as a markdown table."""
    robots = sorted({key.split("/")[0] for key in results})
    heads = [f"{robot}: aim | survived | largest" for robot in robots]
    lines = ["| disturbance | " + " | ".join(heads) + " |", "|---" * (3 * len(robots) + 1) + "|"]
    for name, disturbance in DISTURBANCES.items():
        cells = []
        for robot in robots:
            trials = results.get(f"{robot}/{name}", [])
            cells += _cells(trials, disturbance.target[robot]) if trials else ["", "", "not run"]
        lines.append(f"| {name} [{disturbance.unit}] | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def run_robustness(
    robots: list[str], names: list[str], seeds: list[int], folder: Path, results: dict, *, bisect: bool, workers: int
) -> dict:
    """Studies the disturbances ``names`` with each robot, on top of earlier ``results``; see ``run_study``."""
    jobs = {}
    for robot in robots:
        for name in names:
            known = results.get(f"{robot}/{name}", [])
            jobs[f"{robot}/{name}"] = partial(study, name, robot, folder, seeds, known, bisect=bisect)
    return run_study(jobs, folder / STORE, results, workers=workers, description="disturbances")
