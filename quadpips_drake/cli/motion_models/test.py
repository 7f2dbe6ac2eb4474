"""``quadpips motion-models test``: models on walks that they have not learned from."""

import dataclasses
from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import end_interrupted, messages, say, to_directory, writable_directory
from quadpips_drake.cli.evaluation.evaluate_tracking import known_seeds
from quadpips_drake.cli.motion_models.collect import Gait, Robot
from quadpips_drake.cli.warming import compile_kernels

EPILOG = """
Examples:

  quadpips motion-models test --robot go2 --gait trot

  quadpips motion-models test --robot go2 --gait trot --model model --workers 2

The walks are kept in DIR and not walked again; test_ROBOT_GAIT.json and .png are written anew. Prints true mean absolute
errors along x, and the RMSE of models with fewer inputs, of second degree and of a small network beside it, with 95 %
intervals (bootstrap in blocks of steps).
"""


def test(
    robot: Robot = "anymal_c",
    gait: Gait = "trot",
    model: Annotated[
        Path | None, typer.Option(metavar="DIR", help="What 'train' has made. Default: what comes with the package.")
    ] = None,
    seeds: Annotated[str, typer.Option(metavar="N,N,...", help="Of the walks, one for each.")] = "50,51,52,53,54",
    workers: Annotated[int, typer.Option(min=1, max=256, metavar="W", help="Walks at the same time.")] = 1,
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="For walks and results.")] = Path(
        "out/motion-models-test"
    ),
    sets: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="A setting of the walk, as of 'quadpips walk'.")
    ] = None,
):
    """Walk with seeds that no data were collected with, and print how far off the models are."""
    from quadpips_drake.baselines.motion_models.model_file import check_walk, load_models, model_directory
    from quadpips_drake.baselines.motion_models.variants import read_variants
    from quadpips_drake.benchmark.motion_models.held_out import assessment, held_out_collections, read_held_out, tables
    from quadpips_drake.benchmark.motion_models.prediction_picture import save_prediction_picture
    from quadpips_drake.files import write_json

    collections = held_out_collections(robot, gait, known_seeds(seeds), tuple(sets or ()))
    models = load_models(robot, gait, model)
    variants = read_variants(model_directory(robot, gait, model))
    stages = collections[0].config(0).stages
    check_walk(models, stages.velocity_reference, stages.tracking)
    writable_directory(out)
    compile_kernels()
    _walk_with_progress(out, collections, workers)
    steps = read_held_out(out, collections)
    assessed = assessment(models, variants, steps)
    write_json(out / f"test_{robot}_{gait}.json", _plain(assessed))
    save_prediction_picture(models, steps, out / f"test_{robot}_{gait}.png")
    say(f"{robot} in {gait}: {assessed['steps']} steps of {assessed['walks']} walks, seeds {seeds}\n")
    say(tables(assessed))


def _walk_with_progress(out: Path, collections: list, workers: int) -> None:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from quadpips_drake.benchmark.motion_models.held_out import walk_held_out

    done = total = 0
    try:
        with (
            closing(walk_held_out(out, collections, workers)) as walks,
            Progress(
                TextColumn("walks"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=messages
            ) as progress,
        ):
            bar = progress.add_task("walks", total=None)
            for done, total in walks:
                progress.update(bar, completed=done, total=total)
    except KeyboardInterrupt as interrupt:
        end_interrupted(interrupt, f"{done} of {total} walks lie in {out}; the same command goes on")


def _plain(value):
    """Intervals as dictionaries."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return dataclasses.asdict(value) if dataclasses.is_dataclass(value) else value
