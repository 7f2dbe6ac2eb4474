"""``quadpips learned-footholds train``: a network from the data of 'collect'."""

import time
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import messages, say, to_directory
from quadpips_drake.cli.trials import Overwrite
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  quadpips learned-footholds train --data data --out model

  quadpips run --planner lf_mpc --terrain sparse_stones --set stages.heuristic.reference.learned_model=model

Writes footholds.npz and .json (the network and its card) and curves.png into DIR.
"""

FILES = ("footholds.npz", "footholds.json", "curves.png")
"""What a training writes."""
_WORDS = {
    "wish": "the heuristic's wish as it is",
    "nearest": "the nearest foothold to it",
    "network": "the network, before it is projected",
}


def train(
    data: Annotated[Path, typer.Option(metavar="DIR", help="What 'collect' has made.")],
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="Where the network goes.")],
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="S", help="Of all that is random.")] = 1,
    overwrite: Overwrite = False,
):
    """Train a small network on what the foothold search did, and say how far off it is on walks held out."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    from quadpips_drake.baselines.learned_footholds.training import EPOCHS, save_training, train_footholds
    from quadpips_drake.benchmark.learned_footholds.training_picture import save_training_picture

    started = time.perf_counter()
    with ResultDirectory(out, FILES, overwrite=overwrite) as held:
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("epochs")
        with Progress(*columns, console=messages, disable=not messages.is_terminal) as bar:
            task = bar.add_task("training", total=EPOCHS)
            trained = train_footholds(
                data,
                seed,
                lambda epoch, error: bar.update(task, completed=epoch, description=f"{100 * error:.1f} cm on walks of val"),
            )
        held.clear()
        save_training(out, trained)
        save_training_picture(trained.epochs, trained.card["held_out"], out / "curves.png")
    swings = ", ".join(f"{count} {name}" for name, count in trained.card["data"]["swings"].items())
    say(f"network:  {out}, {trained.network.robot}, swings: {swings}, {time.perf_counter() - started:.0f} s")
    say("distance to the search's footholds on walks held out (test), mean, median, 90 %:")
    for name, found in trained.card["held_out"].items():
        distances = ", ".join(f"{100 * found[kind]:.1f} cm" for kind in ("mean", "median", "p90"))
        say(f"  {_WORDS[name]}: {distances}")
