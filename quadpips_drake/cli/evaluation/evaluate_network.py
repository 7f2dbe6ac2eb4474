"""``quadpips evaluate network``: scores of the steppability network on the test split of a dataset."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import FAILURE, messages, say, to_directory
from quadpips_drake.cli.trials import Overwrite
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  quadpips evaluate network --data data                             the model that comes with the package

  quadpips evaluate network --data data --model model --out scores  one of 'quadpips train'

Exit status: 0 the targets are met, 1 they are not, 2 bad input.
"""

MEAN_IOU, NON_PASSABLE_RECALL, INFERENCE_MS = 0.90, 0.95, 120.0
"""Targets on the noisy test split."""


def network(
    data: Annotated[Path, typer.Option(metavar="DIR", help="What 'quadpips dataset' has made.")],
    model: Annotated[Path | None, typer.Option(metavar="DIR", help="Of 'quadpips train'. Default: the shipped one.")] = None,
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="Where figures and pictures go.")] = Path(
        "evaluation"
    ),
    overwrite: Overwrite = False,
):
    """Score the steppability network: mean IoU, recall, confusion matrix, the worst frames."""
    from rich.progress import track

    from quadpips_drake.learning.dataset import load_split
    from quadpips_drake.learning.evaluation import CONFUSION_PICTURE, REPORT, WORST_PICTURE, save_report, score
    from quadpips_drake.perception.steppability.model import load_model

    with ResultDirectory(out, (REPORT, CONFUSION_PICTURE, WORST_PICTURE), overwrite=overwrite):
        trained, frames = load_model(model), load_split(data, "test")
        steps = iter(track(range(2 * len(frames)), "scoring", console=messages, transient=True))
        scores = score(trained, frames, lambda count: next(steps, None))
        steps.close()
        save_report(scores, trained, frames, out)
    _print_scores(scores)
    say(f"pictures: {out}")
    recall = scores["noisy"]["recall"]["non_passable"] or 0.0
    met = (
        scores["noisy"]["mean_iou"] >= MEAN_IOU and recall >= NON_PASSABLE_RECALL and scores["inference_ms"] <= INFERENCE_MS
    )
    raise typer.Exit(0 if met else FAILURE)


def _print_scores(scores: dict) -> None:
    """Prints a table."""
    from rich import print as show
    from rich.table import Table

    from quadpips_drake.perception.steppability.exported_network import CLASSES

    table = Table("", "noisy", "clean", "target", title=f"{scores['frames']} test frames, data seed {scores['data_seed']}")

    def row(title: str, key: str, name: str | None, target: str = ""):
        values = [scores[part][key] if name is None else scores[part][key][name] for part in ("noisy", "clean")]
        table.add_row(title, *("-" if value is None else f"{value:.3f}" for value in values), target)

    row("mean IoU", "mean_iou", None, f">= {MEAN_IOU}")
    for name in CLASSES:
        row(f"  IoU {name}", "iou", name)
    for name in CLASSES:
        row(f"  recall {name}", "recall", name, f">= {NON_PASSABLE_RECALL}" if name == "non_passable" else "")
    row("accuracy", "accuracy", None)
    table.add_row("inference on one core, ms", f"{scores['inference_ms']:.1f}", "", f"<= {INFERENCE_MS:g}")
    show(table)
