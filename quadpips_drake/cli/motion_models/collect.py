"""``quadpips motion-models collect``: walks through velocity commands, for 'train'."""

import time
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import say, to_directory, with_progress, writable_directory
from quadpips_drake.cli.warming import compile_kernels

EPILOG = """
Examples:

  quadpips motion-models collect --robot go2 --gait trot --minutes 5 --seed 1 --workers 2 --out data

  quadpips motion-models collect --robot go2 --gait trot --minutes 5 --seed 1 --out data --resume   goes on

  quadpips motion-models collect --gait trot --minutes 5 --bumps 0.25 --out bumpy   a quarter on uneven ground

Gaits: trot, standing_trot, slow_trot. Directories of one robot, gait and walk can be trained on together.

Exit status: 0 done, 1 something could not be written or simulated (what is there is kept, --resume goes on), 2 bad input.
"""

Robot = Annotated[str, typer.Option(metavar="NAME", help="Which robot.")]
Gait = Annotated[str, typer.Option(metavar="NAME", help="In which diagonal pairs take turns, see below.")]


def collect(
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="Where the data go.")],
    robot: Robot = "anymal_c",
    gait: Gait = "trot",
    minutes: Annotated[float, typer.Option(min=0.01, max=600.0, metavar="M", help="Walked in all, min.")] = 10.0,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="S", help="Decides every command.")] = 1,
    workers: Annotated[int, typer.Option(min=1, max=256, metavar="W", help="Walks at the same time.")] = 1,
    resume: Annotated[bool, typer.Option("--resume", help="Keep what an interrupted call has made.")] = False,
    bumps: Annotated[
        float, typer.Option(min=0.0, max=1.0, metavar="PART", help="Part of the walks on ground with bumps.")
    ] = 0.0,
    bump_height: Annotated[float, typer.Option(min=0.0, max=0.1, metavar="H", help="Of the bumps, up and down, m.")] = 0.03,
    sets: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="A setting of the walk, as of 'quadpips walk'.")
    ] = None,
):
    """Let a robot walk through pairs of velocities, and take down base and feet at each exchange of the feet."""
    from quadpips_drake.benchmark.motion_models.collecting import Collection
    from quadpips_drake.benchmark.motion_models.collecting import collect as walks_of

    wanted = Collection(robot, gait, minutes, seed, bumps, bump_height, tuple(sets or ()))
    wanted.settings()  # refuses what is wrong with them before anything is written
    writable_directory(out)
    compile_kernels()  # rather than in each of the workers
    started = time.perf_counter()
    done, _, falls = with_progress(walks_of(out, wanted, workers, resume), f"{robot} {gait}", "walks", out)
    fallen = f", {falls} of them cut short by a fall" if falls else ""
    say(f"data:     {out}, {done} walks{fallen}, {time.perf_counter() - started:.0f} s")
