"""``quadpips dataset``: makes labelled depth images for the steppability network."""

import time
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import messages, writable_directory

EPILOG = """
Examples:

  quadpips dataset --frames 3000 --seed 1 --workers 2 --out data

  quadpips dataset --frames 3000 --seed 1 --workers 2 --out data --resume   goes on after an interruption

  quadpips dataset --frames 50 --out try --preview   then look at try/preview.png
"""


def dataset(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the dataset goes.")],
    frames: Annotated[int, typer.Option(min=1, metavar="N", help="Labelled images, in scenes of 5.")] = 3000,
    seed: Annotated[int, typer.Option(min=0, metavar="S", help="Decides every scene.")] = 1,
    workers: Annotated[int, typer.Option(min=1, max=256, metavar="W", help="Processes that render.")] = 2,
    resume: Annotated[bool, typer.Option("--resume", help="Keep what an interrupted call has made.")] = False,
    preview: Annotated[bool, typer.Option("--preview", help="Also write a contact sheet, DIR/preview.png.")] = False,
    swing_height: Annotated[float, typer.Option(metavar="H", help="Highest obstacle that a foot passes, m.")] = 0.15,
):
    """Make labelled depth images of random scenes, for 'quadpips train'."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from quadpips_drake.learning.data_factory import make_dataset
    from quadpips_drake.learning.dataset_config import DatasetConfig
    from quadpips_drake.learning.primitives import LabelPolicy
    from quadpips_drake.sensing.depth_camera import check_renderer

    check_renderer()
    config = DatasetConfig(policy=LabelPolicy(swing_height))
    started = time.perf_counter()
    columns = (TextColumn("dataset"), BarColumn(), MofNCompleteColumn(), TextColumn("shards"), TimeRemainingColumn())
    with Progress(*columns, console=messages) as progress:
        bar = progress.add_task("dataset", total=None)
        for done, total in make_dataset(writable_directory(out), frames, seed, config, workers, resume):
            progress.update(bar, completed=done, total=total)
    typer.echo(f"dataset:  {out}, at least {frames} frames, seed {seed}, {time.perf_counter() - started:.0f} s")
    if preview:
        typer.echo(f"preview:  {_save_preview(out)}")


def _save_preview(directory: Path) -> Path:
    """Writes a contact sheet with frames of the training split; returns its path."""
    import numpy as np

    from quadpips_drake.learning.dataset import load_split
    from quadpips_drake.learning.label_pictures import save_picture, sheet_of_frames, stack_sheets

    frames = load_split(directory, "train", limit=200)
    chosen = np.linspace(0, len(frames) - 1, min(24, len(frames))).astype(int)
    path = directory / "preview.png"
    save_picture(path, stack_sheets([sheet_of_frames(frames, chosen[k : k + 8]) for k in range(0, len(chosen), 8)]))
    return path
