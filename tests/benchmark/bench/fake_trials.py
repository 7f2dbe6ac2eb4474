"""Trials of benches that take no time, importable by worker processes; and a bench of them as a program."""

import os
import signal
import time
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.benchmark.bench.process_pool import ProcessPool
from quadpips_drake.benchmark.bench.rows import BenchTrial, row_of
from quadpips_drake.benchmark.bench.settings import BenchSettings, Course, TrialSpec
from quadpips_drake.cli import bench, console
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.result import TrialResult

SETTINGS = BenchSettings(courses=[Course("anymal_c", "ramp_10"), Course("anymal_c", "stairs")], trials=6, seed=3)
"""Twelve trials."""
CAUSE = {"cause": "push", "time": 4.04, "text": "60 N s", "system": "push", "keys": ["pushes"], "weight": 0.9}
"""Of those that fall."""


def fake_row(spec: TrialSpec, *, bits: str = "") -> dict:
    """The row of a trial whose outcome depends on its seed alone: every third one falls."""
    success = spec.seed % 3 != 0
    result = TrialResult(
        success=success,
        reason="goal_reached" if success else "fell",
        detail="" if success else "roll | pitch reached 0.81 rad",
        cause={} if success else CAUSE,
        robot=spec.robot,
        terrain=spec.terrain,
        planner=spec.planner,
        seed=spec.seed,
        sim_time=10.0 + spec.seed,
        wall_time=12.5,
        realtime_factor=0.9,
        distance_to_goal=0.1 if success else 1.5,
        progress=[[0.0, 0.0], [5.0, 0.45], [10.0, 1.0 if success else 0.5]],
        timings_ms={
            "torso_search": {"n": 10, "p50": 4.0, "p95": 8.0, "max": 9.0 + spec.seed, "total": 50.0},
            "foothold_search": {"n": 5, "p50": 20.0, "p95": 40.0, "max": 60.0, "total": 120.0},
        },
        replans=4,
        fallbacks={"swing_trajectory": spec.seed % 2, "mpc": 0},
        footholds={"planned": 40, "slipped": 1, "missed": 2},
        versions={"python": "3", "quadpips_drake": "0"},
    )
    return row_of(spec, result, bits or f"bits of {spec.key}")


def quick(spec, settings, record=False) -> BenchTrial:
    """A trial that takes no time."""
    return BenchTrial(fake_row(spec), b"<html>" + spec.key.encode() if record else None)


def slow(notes: Path, spec, settings, record=False) -> BenchTrial:
    """A trial that notes that it has begun, and takes a moment."""
    (notes / spec.file_name).touch()
    time.sleep(0.15)
    return quick(spec, settings, record)


def endless(notes: Path, spec, settings, record=False) -> BenchTrial:
    """A trial that notes that it has begun; the one with seed 4 on stairs never ends."""
    with (notes / spec.file_name).open("a") as file:
        file.write("begun\n")
    if (spec.terrain, spec.seed) == ("stairs", 4):
        time.sleep(600.0)
    return quick(spec, settings, record)


def deadly(notes: Path, spec, settings, record=False) -> BenchTrial:
    """A trial that notes that it has begun; with seed 4 its process dies, on the ramp only the first time."""
    with (notes / spec.file_name).open("a") as file:
        file.write("begun\n")
    begun = (notes / spec.file_name).read_text().count("\n")
    if spec.seed == 4 and (spec.terrain == "stairs" or begun == 1):
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(spec, settings, record)


def refused(spec, settings, record=False) -> BenchTrial:
    """A trial that cannot be built with seed 5, and that meets a mistake of ours with seed 6."""
    if spec.seed == 5:
        raise UserInputError("there is no ground under the start")
    if spec.seed == 6:
        raise ZeroDivisionError("float division by zero")
    return quick(spec, settings, record)


def main(
    out: Annotated[Path, typer.Option()], notes: Annotated[Path, typer.Option()], workers: Annotated[int, typer.Option()] = 2
):
    """A bench of slow trials, resumed where there is something."""
    bench.compile_kernels = lambda: True
    out.mkdir(exist_ok=True)
    raise typer.Exit(bench.run_and_report(SETTINGS, out, ProcessPool(workers), resume=True, run=partial(slow, notes)))


if __name__ == "__main__":
    console.run_alone(main)
