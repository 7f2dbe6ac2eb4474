"""``quadpips learned-footholds collect``: answers of the foothold search, for 'train'."""

import shutil
import time
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import say, to_directory, with_progress
from quadpips_drake.cli.trials import Overwrite
from quadpips_drake.cli.warming import compile_kernels
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  quadpips learned-footholds collect --workers 2 --out data

  quadpips learned-footholds collect --workers 2 --out data --resume   goes on after Ctrl-C

  quadpips learned-footholds collect --robot go2 --rounds 5 --seed 2000 --out data   a smaller set, of another robot

Nothing is simulated: the search plans from stance to stance on regions that are known exactly. A round is one walk over each
of eight kinds of terrain; seeds below 1000 are left to trials. Writes manifest.json and swings.npz into DIR.

Exit status: 0 done, 1 something went wrong on the way (what is there is kept, --resume goes on), 2 bad input, 130 Ctrl-C.
"""


def collect(
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="Where the data go.")],
    robot: Annotated[str, typer.Option(metavar="NAME", help="Which robot.")] = "anymal_c",
    rounds: Annotated[int, typer.Option(max=1000, metavar="N", help="Over all kinds of terrain, 5 or more.")] = 10,
    seed: Annotated[int, typer.Option(max=2**31 - 10_000, metavar="S", help="Of the first walk, 1000 or more.")] = 1000,
    workers: Annotated[int, typer.Option(min=1, max=256, metavar="W", help="Walks at the same time.")] = 1,
    resume: Annotated[bool, typer.Option("--resume", help="Keep what an interrupted call has made.")] = False,
    overwrite: Overwrite = False,
):
    """Let the foothold search walk over terrains, and take down each swing: what was there, and where the foot went."""
    from quadpips_drake.baselines.learned_footholds.swing_data import MANIFEST, ROWS, save_swings
    from quadpips_drake.benchmark.learned_footholds.collecting import UNFINISHED, collected, manifest_of, plan_courses
    from quadpips_drake.benchmark.learned_footholds.collecting import collect as walks_of
    from quadpips_drake.robots.robot_library import load_robot

    started = time.perf_counter()
    model, courses = load_robot(robot), plan_courses(rounds, seed)
    with ResultDirectory(out, (MANIFEST, ROWS), overwrite=overwrite) as held:
        if overwrite and not resume:
            shutil.rmtree(out / UNFINISHED, ignore_errors=True)
        compile_kernels()  # rather than in each of the workers
        walks = walks_of(model, courses, seed, out / UNFINISHED, workers=workers, resume=resume)
        with_progress(walks, model.name, "walks", out / UNFINISHED)
        swings = collected(courses, out / UNFINISHED)
        held.clear()
        save_swings(out, swings, manifest_of(model, courses, seed))
        shutil.rmtree(out / UNFINISHED)
    say(f"data:     {out}, {len(swings)} swings of {len(courses)} walks, {time.perf_counter() - started:.0f} s")
