"""Walks that no model has learned from, and how models do on them."""

from collections.abc import Iterator
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.models import MODEL_NAMES, MotionModels, ideal_coefficients
from quadpips_drake.baselines.motion_models.scores import (
    FORWARD,
    UNITS,
    Interval,
    bootstrap_of,
    contradictions,
    excess_interval,
    figures,
    foothold_errors,
    residuals_of,
    rmse_by_step,
    rmse_interval,
)
from quadpips_drake.baselines.motion_models.step_data import Steps, join_steps, read_steps
from quadpips_drake.baselines.motion_models.variants import FULL, ModelVariants
from quadpips_drake.benchmark.motion_models.collecting import Collection, collect
from quadpips_drake.worker_pool import run_jobs

SEEDS = (50, 51, 52, 53, 54)
"""Of the walks."""
WALK_TIME = 9.0
"""Of each of them [s]."""
PAPER = {"cdm": (0.0034, 0.0079), "fdm": (0.0170, 0.0203), "cvm": (0.0317, 0.0445)}
"""Mean absolute errors that the paper prints (Table II), from its courses [m, m, m/s]."""


def walk_held_out(directory: Path, collections: list[Collection], workers: int = 1) -> Iterator[tuple[int, int]]:
    """Walks what is missing in ``directory``; yields (walks done, walks in all), once at the start, then after each."""
    jobs = {c.seed: partial(_walk_one, _folder(directory, c), c) for c in collections}
    yield 0, len(jobs)
    with closing(run_jobs(jobs, workers=workers)) as outcomes:
        for done, outcome in enumerate(outcomes, start=1):
            if outcome.error is not None:
                raise outcome.error
            yield done, len(jobs)


def held_out_collections(robot: str, gait: str, seeds: list[int], sets: tuple[str, ...] = ()) -> list[Collection]:
    """One walk for each of ``seeds``."""
    return [Collection(robot, gait, WALK_TIME / 60.0, seed, sets=sets, walk_time=WALK_TIME) for seed in seeds]


def read_held_out(directory: Path, collections: list[Collection]) -> Steps:
    """The steps of these walks."""
    parts = [read_steps(_folder(directory, collection)) for collection in collections]
    return join_steps(
        [Steps(p.inputs, p.outputs, p.swing, p.walk + c.seed, p.duration) for p, c in zip(parts, collections, strict=True)]
    )


def assessment(models: MotionModels, variants: ModelVariants, steps: Steps) -> dict:
    """Figures of the models on ``steps`` along x, those of an ideal walk, and Table I: RMSE of variants with intervals."""
    ideal = ideal_coefficients(models.step_duration)[0]
    residuals = {name: residuals_of(predict, steps) for name, predict in variants.predictors().items()}
    draws = bootstrap_of(steps.walk)
    rmse, excess = {}, {}
    for name, r in residuals.items():
        rmse[name] = {model: rmse_interval(r, FORWARD[model], draws) for model in MODEL_NAMES}
        excess[name] = {model: excess_interval(r, residuals[FULL], FORWARD[model], draws) for model in MODEL_NAMES}
    return {
        "steps": len(steps),
        "walks": len(np.unique(steps.walk)),
        "errors": figures(residuals_of(lambda x: x @ models.coefficients[0].T, steps), FORWARD),
        "ideal": figures(residuals_of(lambda x: x @ ideal.T, steps), FORWARD),
        "rmse": rmse,
        "excess": excess,
        "footholds_ahead": {
            name: rmse_by_step(foothold_errors(lambda x, fit=fit: x @ fit.T, steps)) for name, fit in variants.linear.items()
        },
        "contradictions": contradictions({name: value for name, value in excess.items() if name != FULL}),
    }


def tables(assessed: dict) -> str:
    """An ``assessment`` as markdown tables and lines."""
    lines = [
        "| along x | MAE | mean, signed | RMSE | MAE of the paper's courses | MAE if commands were followed at once |",
        "|---|---|---|---|---|---|",
    ]
    for name in MODEL_NAMES:
        mine, low_high = assessed["errors"][name], PAPER[name]
        lines.append(
            f"| {name.upper()} [{UNITS[name]}] | {mine['mae']:.4f} | {mine['mean']:+.4f} | {mine['rmse']:.4f} "
            f"| {low_high[0]:.4f} to {low_high[1]:.4f} | {assessed['ideal'][name]['mae']:.4f} |"
        )
    names = list(assessed["rmse"])
    lines += ["", "| RMSE along x | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    for model in MODEL_NAMES:
        cells = [_cell(assessed["rmse"][name][model]) for name in names]
        lines.append(f"| {model.upper()} [{UNITS[model]}] | " + " | ".join(cells) + " |")
    ahead = assessed["footholds_ahead"]
    numbers = range(1, len(ahead[FULL]) + 1)
    lines += ["", "| RMSE of footholds along x, steps ahead [m] | " + " | ".join(map(str, numbers)) + " |"]
    lines += ["|---" * (len(numbers) + 1) + "|"]
    lines += [f"| {name} | " + " | ".join(f"{value:.3f}" for value in values) + " |" for name, values in ahead.items()]
    lines += ["", "Against the paper's Table I:"]
    lines += [f"- {line}" for line in assessed["contradictions"]] or ["- no contradiction"]
    return "\n".join(lines)


def _cell(interval: Interval) -> str:
    return f"{interval.value:.4f} ({interval.low:.4f} to {interval.high:.4f})"


def _folder(directory: Path, collection: Collection) -> Path:
    return Path(directory) / f"{collection.robot}_{collection.gait}_{collection.seed}"


def _walk_one(folder: Path, collection: Collection) -> None:
    """In a worker: walks, unless that has been done."""
    folder.mkdir(parents=True, exist_ok=True)
    for _ in collect(folder, collection, workers=0, resume=True):
        pass
