"""``quadpips motion-models train``: linear models from the data of 'collect'."""

import time
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import messages, say, to_directory
from quadpips_drake.cli.trials import Overwrite
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  quadpips motion-models train --data data --out model

  quadpips motion-models train --data data --data more --out model   on two datasets of one robot, gait and walk

  quadpips motion-models test --robot go2 --model model

Writes motion_models.npz and .json (the models and their card), variants.npz (for comparisons) and curves.png into DIR.
"""

FILES = ("motion_models.npz", "motion_models.json", "variants.npz", "curves.png")
"""What a training writes."""


def train(
    data: Annotated[list[Path], typer.Option(metavar="DIR", help="What 'collect' has made; may be repeated.")],
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="Where the models go.")],
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="S", help="Of all that is random.")] = 1,
    overwrite: Overwrite = False,
):
    """Fit models of base and feet to data, by least squares, and what they are compared with."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    from quadpips_drake.baselines.motion_models.training import save_training, train_models
    from quadpips_drake.benchmark.motion_models.training_picture import save_training_picture

    started = time.perf_counter()
    with ResultDirectory(out, FILES, overwrite=overwrite) as held:
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
        with Progress(*columns, console=messages, disable=not messages.is_terminal) as bar:
            task = bar.add_task("", total=None)
            trained = train_models(
                data, seed, lambda what, done, total: bar.update(task, description=what, completed=done, total=total)
            )
        held.clear()
        save_training(out, trained)
        save_training_picture(trained.curve, trained.epochs, out / "curves.png")
    _tell(out, trained, time.perf_counter() - started)


def _tell(out: Path, trained, seconds: float) -> None:
    models, card = trained.models, trained.card
    steps = ", ".join(f"{count} {name}" for name, count in card["data"]["steps"].items())
    say(f"models:   {out}, {models.robot} in {models.gait}, {card['data']['walks']} walks, steps: {steps}, {seconds:.0f} s")
    for name, figures in card["other_walks"]["x"].items():
        say(f"{name}:      MAE {figures['mae']:.4f}, RMSE {figures['rmse']:.4f} along x on walks of val and test")
