"""How hard a walk has to be hit before the robot falls: the largest value survived of each disturbance, by bisection.

Run it with ``python -m quadpips_drake.benchmark.robustness --out DIR``; results are kept in DIR/robustness.json, and what is
known already is not computed again.
"""

import json
import math
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.benchmark.trial_options import resolve_config
from quadpips_drake.benchmark.walk_trial import WalkTrial, WalkTrialConfig
from quadpips_drake.control.gaits import load_gait
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.terrain import library
from quadpips_drake.terrain.terrain_file import write_terrain_file

PUSH_TIME = 3.0
"""When pushes begin [s], counted from a whole number of cycles."""
PUSH_DURATION = 0.1
"""[s]"""
PUSH_PHASES = 5
"""Phases of the gait at which a push is tried."""
SPEED = 0.3
"""Of the walk [m/s]."""


@dataclass(frozen=True)
class Disturbance:
    """One kind of disturbance, in a size that can be bisected; ``least`` is harmless, ``most`` more than is hoped for."""

    unit: str
    least: float
    most: float
    resolution: float
    target: dict
    """What is aimed at, by robot."""
    trial: Callable
    """(size, robot, folder for files) -> options for WalkTrialConfig and ``--set`` texts."""
    extra: dict = field(default_factory=dict)
    """Other ``most`` for some robots."""


def _push(phase: int, size: float, robot: str, folder: Path):
    gait = load_gait("trot")
    time = PUSH_TIME + gait.duration * phase / PUSH_PHASES
    push = {"force": [0.0, size / PUSH_DURATION, 0.0], "time": time, "duration": PUSH_DURATION}
    return {"pushes": [push], "duration": time + 3.0}, []


def _friction(size: float, robot: str, folder: Path):
    # Slipperiness is bisected, so that more is worse: 1 - mu.
    return {"duration": 6.0}, [f"stages.station.model_error.friction={1.0 - size}"]


def _slope(way: str, size: float, robot: str, folder: Path):
    path = folder / f"slope_{size:.2f}.yaml"
    write_terrain_file(library.slope(angle=math.radians(size)), path)
    run = 3.0 * math.cos(math.radians(size))
    options = {"terrain": str(path), "duration": 9.0, "start": [-0.7, 0.0, 0.0]}
    if way == "down":
        options["start"] = [run + 1.2, 0.0, 0.0]
    if way == "across":
        options["duration"] = 13.0
        options["changes"] = [
            {"time": 5.5, "gait": "trot", "velocity": [0.0, 0.0, 0.5]},
            {"time": 8.8, "gait": "trot", "velocity": [SPEED, 0.0, 0.0]},
        ]
    return options, []


def _bumps(size: float, robot: str, folder: Path):
    path = folder / f"bumps_{size:.4f}.yaml"
    write_terrain_file(library.bumps(height=size, seed=0), path)
    return {"terrain": str(path), "duration": 11.0}, []


def _model(key: str, duration: float, size: float, robot: str, folder: Path):
    return {"duration": duration}, [f"{key}={size}"]


def _payload(size: float, robot: str, folder: Path):
    from quadpips_drake.robots.robot_model import load_robot

    return {"duration": 6.0}, [f"stages.station.model_error.payload={size * load_robot(robot).mass}"]


def _disturbances() -> dict[str, Disturbance]:
    both = ("anymal_c", "go2")
    table = {
        f"push_phase_{phase}": Disturbance(
            "N s", 0.0, 60.0, 1.0, {"anymal_c": 25.0, "go2": 7.0}, partial(_push, phase), {"go2": 20.0}
        )
        for phase in range(PUSH_PHASES)
    }
    table["slipperiness"] = Disturbance("1 - mu", 0.0, 0.9, 0.05, dict.fromkeys(both, 0.6), _friction)
    for way in ("up", "down", "across"):
        table[f"slope_{way}"] = Disturbance("deg", 1.0, 25.0, 2.0, dict.fromkeys(both, 15.0), partial(_slope, way))
    table["bumps"] = Disturbance("m", 0.001, 0.08, 0.005, dict.fromkeys(both, 0.03), _bumps)
    table["payload"] = Disturbance("of the mass", 0.0, 0.6, 0.05, dict.fromkeys(both, 0.2), _payload)
    delay = partial(_model, "stages.tracking.mpc.delay", 6.0)
    table["mpc_delay"] = Disturbance("s", 0.0, 0.1, 0.01, dict.fromkeys(both, 0.02), delay)
    late = partial(_model, "stages.station.model_error.actuator_delay", 6.0)
    table["actuator_delay"] = Disturbance("s", 0.0, 0.04, 0.002, dict.fromkeys(both, 0.0), late)
    return table


DISTURBANCES = _disturbances()


def survives(name: str, size: float, robot: str, folder: Path, seed: int) -> dict:
    """One trial: "survived", and what else is worth knowing."""
    options, sets = DISTURBANCES[name].trial(size, robot, folder)
    velocity = [SPEED, 0.0, 0.0]
    options = {"robot": robot, "gait": "trot", "velocity": velocity, "seed": seed, "start_position_noise": 0.0, **options}
    trial = WalkTrial(resolve_config(WalkTrialConfig, None, options, sets))
    trial.run()
    result = trial.result()
    return {"size": size, "survived": result.success, "detail": result.detail, "max_tilt": result.walk["max_tilt"]}


def study(name: str, robot: str, folder: Path, seed: int, known: list[dict], *, target_only: bool = False) -> list[dict]:
    """Trials of one disturbance with one robot: first at the target, then bisecting until the resolution is reached.

    Args:
        known: trials that have been run before; they are not repeated.
        target_only: whether the target alone is tried.

    Returns: all trials. It is taken for granted that what is survived is survived in smaller sizes, too.
    """
    disturbance = DISTURBANCES[name]
    trials = list(known)
    low, high = disturbance.least, disturbance.extra.get(robot, disturbance.most)
    size = disturbance.target[robot] or 0.5 * (low + high)
    while True:
        done = next((trial for trial in trials if abs(trial["size"] - size) < 1e-9), None)
        if done is None:
            done = survives(name, size, robot, folder, seed)
            trials.append(done)
        low, high = (max(low, size), high) if done["survived"] else (low, min(high, size))
        if target_only or high - low <= disturbance.resolution + 1e-9:
            return trials
        size = 0.5 * (low + high)


def largest_survived(trials: list[dict]) -> float | None:
    """The largest size survived below the smallest one that was not."""
    fallen = min((trial["size"] for trial in trials if not trial["survived"]), default=math.inf)
    return max((trial["size"] for trial in trials if trial["survived"] and trial["size"] < fallen), default=None)


def table(results: dict) -> str:
    """The results, {"robot/disturbance": trials}, as a markdown table."""
    robots = sorted({key.split("/")[0] for key in results})
    lines = ["| disturbance | " + " | ".join(f"{robot} (aim)" for robot in robots) + " |", "|---" * (len(robots) + 1) + "|"]
    for name, disturbance in DISTURBANCES.items():
        cells = []
        for robot in robots:
            trials = results.get(f"{robot}/{name}", [])
            best = largest_survived(trials)
            tried = max((trial["size"] for trial in trials if trial["survived"]), default=None)
            failed = any(not trial["survived"] for trial in trials)
            text = "not run" if not trials else "none" if best is None else f"{best:.3g}"
            text += " or more" if best is not None and not failed and tried == best else ""
            cells.append(f"{text} ({disturbance.target[robot]:.3g})")
        lines.append(f"| {name} [{disturbance.unit}] | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main(
    out: Annotated[Path, typer.Option(metavar="DIR", help="For robustness.json and terrain files.")] = Path(
        "out/robustness"
    ),
    robots: Annotated[str, typer.Option(metavar="A,B", help="Which robots.")] = "anymal_c,go2",
    only: Annotated[str, typer.Option(metavar="A,B", help="Which disturbances. Default: all.")] = "",
    seed: Annotated[int, typer.Option(metavar="N", help="Of the trials.")] = 100,
    workers: Annotated[int, typer.Option(min=1, metavar="N", help="Trials at the same time.")] = 1,
    target_only: Annotated[bool, typer.Option("--target-only", help="Try the targets alone, without bisection.")] = False,
):
    """Find the largest push, slope, delay ... that a trotting robot survives; prints a markdown table."""
    names = only.split(",") if only else list(DISTURBANCES)
    for name in names:
        if name not in DISTURBANCES:
            raise unknown_name("disturbance", name, DISTURBANCES)
    out.mkdir(parents=True, exist_ok=True)
    store = out / "robustness.json"
    results = json.loads(store.read_text()) if store.exists() else {}
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        jobs = {}
        for name in names:
            for robot in robots.split(","):
                key = f"{robot}/{name}"
                known = results.get(key, [])
                jobs[pool.submit(study, name, robot, out, seed, known, target_only=target_only)] = key
        for job in as_completed(jobs):
            key = jobs[job]
            try:
                results[key] = job.result()
            except UserInputError as error:
                typer.echo(f"{key}: {error}", err=True)
                continue
            store.write_text(json.dumps(results, indent=1), encoding="utf-8")
            typer.echo(f"{key}: {largest_survived(results[key])} ({len(results[key])} trials)", err=True)
    typer.echo(table(results))


if __name__ == "__main__":
    typer.run(main)
