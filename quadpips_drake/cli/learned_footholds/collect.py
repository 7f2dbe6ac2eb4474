"""``quadpips learned-footholds collect``: answers of the foothold search, for 'train'."""

import time
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import messages, say, to_directory
from quadpips_drake.cli.trials import Overwrite
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  quadpips learned-footholds collect --out data

  quadpips learned-footholds collect --robot go2 --rounds 5 --seed 2000 --out data   a smaller set, of another robot

Nothing is simulated: the search plans from stance to stance on regions that are known exactly. A round is one walk over each
of eight kinds of terrain; seeds below 1000 are left to trials. Writes manifest.json and swings.npz into DIR.
"""


def collect(
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="Where the data go.")],
    robot: Annotated[str, typer.Option(metavar="NAME", help="Which robot.")] = "anymal_c",
    rounds: Annotated[int, typer.Option(max=1000, metavar="N", help="Over all kinds of terrain, 5 or more.")] = 10,
    seed: Annotated[int, typer.Option(max=2**31 - 10_000, metavar="S", help="Of the first walk, 1000 or more.")] = 1000,
    overwrite: Overwrite = False,
):
    """Let the foothold search walk over terrains, and take down each swing: what was there, and where the foot went."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from quadpips_drake.baselines.learned_footholds.swing_data import MANIFEST, ROWS, Swings, save_swings
    from quadpips_drake.benchmark.learned_footholds.collecting import collect as rows_of
    from quadpips_drake.benchmark.learned_footholds.collecting import manifest_of, plan_courses
    from quadpips_drake.robots.robot_library import load_robot

    started, rows = time.perf_counter(), []
    model, courses = load_robot(robot), plan_courses(rounds, seed)
    with ResultDirectory(out, (MANIFEST, ROWS), overwrite=overwrite) as held:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("walks"),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=messages) as progress:
            bar = progress.add_task(f"{model.name}, swings: 0", total=len(courses))
            for more in rows_of(model, courses):
                rows += more
                progress.update(bar, advance=1, description=f"{model.name}, swings: {len(rows)}")
        held.clear()
        save_swings(out, Swings.of(rows), manifest_of(model, courses, seed))
    say(f"data:     {out}, {len(rows)} swings of {len(courses)} walks, {time.perf_counter() - started:.0f} s")
