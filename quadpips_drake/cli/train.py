"""``quadpips train``: trains the steppability network."""

import time
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from quadpips_drake.cli.console import end_interrupted, messages, say, to_directory
from quadpips_drake.cli.trials import Overwrite
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  quadpips dataset --frames 3000 --seed 1 --workers 2 --out data

  quadpips train --data data --out model

  quadpips train --data data --data more --out model   on two datasets; the first one's 'val' validates

  quadpips train --data more --init model --out finer   goes on from another run's weights, with a new schedule

  quadpips train --data data --out model --resume   goes on after an interruption

  quadpips evaluate network --data data --model model --out scores
"""

FILES = ("checkpoint.pt", "history.json", "steppability.pt", "steppability.onnx", "steppability.json", "curves.png")
"""What a training writes."""


def train(
    data: Annotated[list[Path], typer.Option(metavar="DIR", help="What 'quadpips dataset' has made; may be repeated.")],
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="Where model, checkpoint and curves go.")],
    epochs: Annotated[int, typer.Option(min=1, max=10000, metavar="N", help="Rounds over the data.")] = 5,
    batch: Annotated[int, typer.Option(min=1, max=1024, metavar="N", help="Images per step.")] = 8,
    seed: Annotated[int, typer.Option(min=0, metavar="S", help="Of initial weights and order.")] = 1,
    threads: Annotated[int, typer.Option(min=1, max=256, metavar="N", help="Threads of torch, without a GPU.")] = 1,
    init: Annotated[Path | None, typer.Option(metavar="DIR", help="Begin with the weights of this model.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from DIR/checkpoint.pt.")] = False,
    overwrite: Overwrite = False,
):
    """Train the steppability network on a dataset; on a GPU where there is one."""
    started = time.perf_counter()
    held = ResultDirectory(out, FILES, overwrite=overwrite or resume)
    with held, TrainingProgress() as progress:
        trainer = _make_trainer(progress, data, out, {"epochs": epochs, "batch": batch, "seed": seed}, threads, init, resume)
        if not resume:
            held.clear()
        try:
            _train(trainer, progress, out)
        except KeyboardInterrupt as interrupt:
            kept = f"{out / 'checkpoint.pt'} holds {len(trainer.history)} of {epochs} epochs, --resume goes on"
            end_interrupted(interrupt, kept if trainer.history else "no epoch was finished")
    best = max(trainer.history, key=lambda entry: entry["val"]["mean_iou"])
    say(f"model:    {out}, best in epoch {best['epoch']}, {time.perf_counter() - started:.0f} s on {trainer.device}")
    say(f"val:      mean IoU {best['val']['mean_iou']:.3f}; recall {best['val']['recall']}")


class TrainingProgress:
    """Says what is being done from the start on: a bar on a terminal, else a line for each thing."""

    def __init__(self):
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        self._bar = Progress(*columns, console=messages)
        self._task = self._bar.add_task("", total=None)

    def __enter__(self):
        if messages.is_terminal:
            self._bar.start()
        return self

    def __exit__(self, *_):
        if messages.is_terminal:
            self._bar.stop()

    def say(self, what: str) -> None:
        """What is being done now."""
        self._bar.update(self._task, description=what)
        if not messages.is_terminal:
            messages.print(what, markup=False)

    def show(self, text: str, done: int, total: int) -> None:
        """Where the training stands, after ``done`` of ``total`` steps."""
        self._bar.update(self._task, description=text, completed=done, total=total)


def _make_trainer(progress: TrainingProgress, data: list[Path], out: Path, settings: dict, threads, init, resume):
    progress.say("loading PyTorch")
    import torch

    from quadpips_drake.learning.dataset import join_frames, load_split
    from quadpips_drake.learning.model_files import load_network
    from quadpips_drake.learning.training import Trainer, TrainingConfig

    config = TrainingConfig(**settings)
    progress.say(f"reading {', '.join(map(str, data))}")
    # The first dataset alone validates, so that scores stay comparable whatever else is trained on.
    train, val = join_frames([load_split(directory, "train") for directory in data]), load_split(data[0], "val")
    progress.say("making the network")
    torch.set_num_threads(threads)
    trainer = Trainer(train, val, out, config)
    if init is not None:
        trainer.start_from(*load_network(init))
    if resume:
        trainer.resume()
    progress.say(f"training on {len(train)} images; the first batch takes longest")
    return trainer


def _train(trainer, progress: TrainingProgress, out: Path) -> None:
    """Trains, and draws the curves after each epoch."""
    from quadpips_drake.learning.training_curves import save_curves

    steps = trainer.steps_per_epoch

    def show(step: int, loss: float):
        text = step_text(len(trainer.history) + 1, loss, trainer.history[-1]["val"]["mean_iou"] if trainer.history else None)
        if step % steps == 0:
            text += ", validating"
            if not messages.is_terminal:
                progress.say(text)
        progress.show(text, step, trainer.epochs * steps)
        if step % steps == 1:
            save_curves(trainer.history, out / "curves.png")

    trainer.run(show)
    save_curves(trainer.history, out / "curves.png")


def step_text(epoch: int, loss: float, iou: float | None) -> str:
    """One line about a step; ``iou`` is that of the epoch before, None in the first one."""
    return f"epoch {epoch}, loss {loss:.3f}" + ("" if iou is None else f", val IoU {iou:.3f} before")
