"""``quadpips dataset``: makes labelled depth images for the steppability network."""

import time
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import say, to_directory, with_progress, writable_directory
from quadpips_drake.cli.warming import compile_kernels

EPILOG = """
Examples:

  quadpips dataset --frames 3000 --seed 1 --workers 2 --out data

  quadpips dataset --frames 3000 --seed 1 --workers 2 --out data --resume   goes on after an interruption

  quadpips dataset --frames 50 --out try --preview   then look at try/preview.png

Exit status: 0 done, 1 something could not be written or rendered (what is there is kept, --resume goes on), 2 bad input.
"""


def dataset(
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="Where the dataset goes.")],
    frames: Annotated[int, typer.Option(min=50, metavar="N", help="Labelled images, in scenes of 5.")] = 3000,
    seed: Annotated[int, typer.Option(min=0, metavar="S", help="Decides every scene.")] = 1,
    workers: Annotated[int, typer.Option(min=1, max=256, metavar="W", help="Processes that render.")] = 2,
    resume: Annotated[bool, typer.Option("--resume", help="Keep what an interrupted call has made.")] = False,
    preview: Annotated[bool, typer.Option("--preview", help="Also write a contact sheet, DIR/preview.png.")] = False,
    swing_height: Annotated[float, typer.Option(metavar="H", help="Highest obstacle that a foot passes, m.")] = 0.15,
):
    """Make labelled depth images of random scenes, for 'quadpips train'."""
    from quadpips_drake.learning.data_factory import make_dataset, plan_shards
    from quadpips_drake.learning.dataset_config import DatasetConfig
    from quadpips_drake.learning.primitives import LabelPolicy
    from quadpips_drake.sensing.depth_camera import check_renderer

    config = DatasetConfig(policy=LabelPolicy(swing_height))
    plan_shards(frames, config)  # refuses too few before anything is written
    writable_directory(out)
    check_renderer()
    compile_kernels()  # rather than in each of the workers
    started = time.perf_counter()
    with_progress(make_dataset(out, frames, seed, config, workers, resume), "dataset", "shards", out)
    say(f"dataset:  {out}, at least {frames} frames, seed {seed}, {time.perf_counter() - started:.0f} s")
    if preview:
        say(f"preview:  {_save_preview(out)}")


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
