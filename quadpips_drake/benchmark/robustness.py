"""How hard a walk has to be hit before the robot falls: targets with several seeds, and the largest size by bisection."""

import math
from functools import partial
from pathlib import Path

from quadpips_drake.benchmark.disturbances import DISTURBANCES, trial_options
from quadpips_drake.benchmark.study_pool import Study, run_study
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


def wanted_trials(
    name: str, robot: str, seeds: list[int], trials: list[dict], *, bisect: bool = True
) -> list[tuple[float, int]]:
    """Sizes and seeds of one disturbance that should be tried next with one robot; none when all is known.

    The target comes first, with the first seed; then with the others, while the first one is bisected with until the
    resolution is reached, size after size. Bisection takes for granted that what is survived is survived in smaller sizes,
    too.

    Args:
        trials: those that have been run, see ``survives``; they are not repeated.
        bisect: whether to do more than the target.
    """
    disturbance = DISTURBANCES[name]
    outcomes = {(round(trial["size"], 9), trial["seed"]): trial["survived"] for trial in trials}
    low, high = disturbance.least, disturbance.largest(robot)
    target = disturbance.target[robot]
    if target > 0.0 and (round(target, 9), seeds[0]) not in outcomes:
        return [(target, seeds[0])]
    wanted = [(target, seed) for seed in seeds[1:] if target > 0.0 and (round(target, 9), seed) not in outcomes]
    size = target or 0.5 * (low + high)
    while bisect and high - low > disturbance.resolution + 1e-9:
        survived = outcomes.get((round(size, 9), seeds[0]))
        if survived is None:
            return [*wanted, (size, seeds[0])]
        low, high = (size, high) if survived else (low, size)
        size = 0.5 * (low + high)
    return wanted


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


def table(results: dict, robots: list[str], names: list[str]) -> str:
    """The results, {"robot/disturbance": trials}, of ``robots`` and disturbances ``names`` as a markdown table."""
    heads = [f"{robot}: aim | survived | largest" for robot in robots]
    lines = ["| disturbance | " + " | ".join(heads) + " |", "|---" * (3 * len(robots) + 1) + "|"]
    for name in names:
        disturbance, cells = DISTURBANCES[name], []
        for robot in robots:
            trials = results.get(f"{robot}/{name}", [])
            cells += _cells(trials, disturbance.target[robot]) if trials else ["", "", "no result"]
        lines.append(f"| {name} [{disturbance.unit}] | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def run_robustness(
    robots: list[str], names: list[str], seeds: list[int], folder: Path, results: dict, *, bisect: bool, workers: int
) -> Study:
    """Studies the disturbances ``names`` with each robot, on top of earlier ``results``; see ``run_study``."""
    begun = set()

    def wanted(robot: str, name: str, trials: list[dict]) -> dict:
        jobs = {}
        for size, seed in wanted_trials(name, robot, seeds, trials, bisect=bisect):
            key = f"{robot}/{name}/{size:g}/{seed}"
            if key not in begun:
                begun.add(key)
                jobs[key] = partial(survives, name, size, robot, folder, seed)
        return jobs

    def keep(results: dict, key: str, trial: dict) -> dict:
        robot, name, _, _ = key.split("/")
        trials = results[f"{robot}/{name}"] = [*results.get(f"{robot}/{name}", []), trial]
        return wanted(robot, name, trials)

    jobs = {}
    for robot in robots:
        for name in names:
            jobs |= wanted(robot, name, results.get(f"{robot}/{name}", []))
    return run_study(jobs, folder / STORE, results, workers=workers, description="trials", keep=keep)
