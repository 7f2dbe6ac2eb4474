"""``quadpips train``: trains the steppability network."""

import time
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import messages, writable_directory

EPILOG = """
Examples:

  quadpips dataset --frames 3000 --seed 1 --workers 2 --out data

  quadpips train --data data --out model

  quadpips train --data data --data more --out model   on two datasets; the first one's 'val' validates

  quadpips train --data more --init model --out finer   goes on from another run's weights, with a new schedule

  quadpips train --data data --out model --resume   goes on after an interruption

  quadpips evaluate network --data data --model model --out scores
"""


def train(
    data: Annotated[list[Path], typer.Option(metavar="DIR", help="What 'quadpips dataset' has made; may be repeated.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where model, checkpoint and curves go.")],
    epochs: Annotated[int, typer.Option(min=1, max=10000, metavar="N", help="Rounds over the data.")] = 5,
    batch: Annotated[int, typer.Option(min=1, max=1024, metavar="N", help="Images per step.")] = 8,
    seed: Annotated[int, typer.Option(min=0, metavar="S", help="Of initial weights and order.")] = 1,
    threads: Annotated[int, typer.Option(min=1, max=256, metavar="N", help="Threads of torch, without a GPU.")] = 1,
    init: Annotated[Path | None, typer.Option(metavar="DIR", help="Begin with the weights of this model.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from DIR/checkpoint.pt.")] = False,
):
    """Train the steppability network on a dataset; on a GPU where there is one."""
    import torch
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from quadpips_drake.learning.dataset import join_frames, load_split
    from quadpips_drake.learning.training import Trainer, TrainingConfig
    from quadpips_drake.learning.training_curves import save_curves
    from quadpips_drake.perception.steppability.model import load_model

    config = TrainingConfig(epochs=epochs, batch=batch, seed=seed)
    # The first dataset alone validates, so that scores stay comparable whatever else is trained on.
    frames = join_frames([load_split(directory, "train") for directory in data]), load_split(data[0], "val")
    torch.set_num_threads(threads)
    trainer = Trainer(*frames, writable_directory(out), config)
    if init is not None:
        trainer.start_from(load_model(init))
    if resume:
        trainer.resume()
    started, total = time.perf_counter(), epochs * trainer.steps_per_epoch
    text = TextColumn("epoch {task.fields[epoch]}  loss {task.fields[loss]:.3f}  val IoU {task.fields[iou]:.3f}")
    with Progress(text, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=messages) as progress:
        bar = progress.add_task("", total=total, epoch=1, loss=float("nan"), iou=float("nan"))

        def show(step: int, loss: float):
            iou = trainer.history[-1]["val"]["mean_iou"] if trainer.history else float("nan")
            epoch = len(trainer.history) + 1
            progress.update(bar, completed=step, epoch=epoch, loss=loss, iou=iou)
            if step % trainer.steps_per_epoch == 1:
                save_curves(trainer.history, out / "curves.png")

        trainer.run(show)
    save_curves(trainer.history, out / "curves.png")
    best = max(trainer.history, key=lambda entry: entry["val"]["mean_iou"])
    typer.echo(f"model:    {out}, best in epoch {best['epoch']}, {time.perf_counter() - started:.0f} s on {trainer.device}")
    typer.echo(f"val:      mean IoU {best['val']['mean_iou']:.3f}; recall {best['val']['recall']}")
