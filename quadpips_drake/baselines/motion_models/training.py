"""From walks to models: fits, variants, figures on other walks, and what is written."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.fitting import LINEAR_VARIANTS, fit_linear, fit_variant, left_out_residuals
from quadpips_drake.baselines.motion_models.model_file import save_models
from quadpips_drake.baselines.motion_models.models import MODEL_NAMES, MotionModels, models_of_both_pairs
from quadpips_drake.baselines.motion_models.scores import (
    FORWARD,
    LEFT,
    figures,
    foothold_errors,
    residuals_of,
    rmse_by_step,
)
from quadpips_drake.baselines.motion_models.small_network import EPOCHS, fit_network
from quadpips_drake.baselines.motion_models.state import INPUTS, OUTPUT_SIGNS
from quadpips_drake.baselines.motion_models.step_data import Steps, join_steps, read_manifest_of, read_steps
from quadpips_drake.baselines.motion_models.variants import ModelVariants, linear_and_quadratic, save_variants
from quadpips_drake.errors import UserInputError

FEWEST = 2 * INPUTS
"""Steps of the shortest fit [1]."""
_DRAWS = 20
"""Random choices of steps for each point of the learning curve."""
_DIGITS = 5
_SPLITS = ("train", "val", "test")


@dataclass(frozen=True, eq=False)
class TrainedModels:
    """What a training gives."""

    models: MotionModels
    variants: ModelVariants
    card: dict
    """Where they come from, and their figures."""
    curve: list[dict]
    """"steps" and the RMSE along x by model on the walks of val and test: how much data is needed."""
    epochs: list[dict]
    """Of the network."""


def train_models(
    directories: list[Path], seed: int, progress: Callable[[str, int, int], None] = lambda *_: None
) -> TrainedModels:
    """Learns from the data in ``directories``.

    Figures are of models that were fitted to the walks of ``train`` alone. What is kept is fitted to all walks; its figures
    come from held-out walks of other seeds ('motion-models test'), and its covariance from leaving out one walk at a time.

    Args:
        directories: of one robot, gait and walk.
        seed: of the network and of random choices.
        progress: (what is done, how much of it, of how much).

    Raises:
        UserInputError: data are missing, damaged, too few, or tell nothing of an input.
    """
    manifests = [read_manifest_of(directory) for directory in directories]
    _check_alike(directories, manifests)
    progress("reading", 0, 1)
    train, val, test = (_steps_of_all(directories, split) for split in _SPLITS)
    if not len(val):
        raise UserInputError("--data: no walks for validation; collect more minutes")
    others = join_steps([val, test])
    every = join_steps([train, others])
    progress("fitting", 0, 1)
    first = fit_linear(train)
    curve = learning_curve(train, others, seed)
    linear, quadratic = linear_and_quadratic(every)
    network, epochs = fit_network(
        join_steps([train, test]), val, seed, lambda epoch, loss, _: progress(f"network, loss {loss:.4f}", epoch, EPOCHS)
    )
    residuals = left_out_residuals(every)
    covariance = np.cov(residuals.T)
    models = MotionModels(
        robot=manifests[0]["robot"],
        gait=manifests[0]["gait"],
        step_duration=round(float(np.median(every.duration)), 4),
        coefficients=models_of_both_pairs(linear["full"]),
        covariance=np.stack((covariance, covariance * np.outer(OUTPUT_SIGNS, OUTPUT_SIGNS))),
        settings=manifests[0]["settings"],
        top_speed=min(manifest["top_speed"] for manifest in manifests),
    )
    card = {
        "data": {
            "seeds": [manifest["seed"] for manifest in manifests],
            "walks": int(sum(len(manifest["walks"]) for manifest in manifests)),
            "steps": {name: len(part) for name, part in zip(_SPLITS, (train, val, test), strict=True)},
            "bumpy_share": [manifest.get("bumpy_share", 0.0) for manifest in manifests],
        },
        "seed": seed,
        "other_walks": _rounded(residuals_of(lambda x: x @ first.T, others)),
        "one_walk_left_out": _rounded(residuals),
        "footholds_ahead": _footholds_ahead(train, others),
        "network_parameters": network.parameters,
    }
    return TrainedModels(models, ModelVariants(linear, quadratic, network), card, curve, epochs)


def save_training(directory: Path, trained: TrainedModels) -> None:
    """Writes models, card and variants."""
    more = {**trained.card, "curve": trained.curve, "network_epochs": trained.epochs[:: max(1, EPOCHS // 8)]}
    save_models(directory, trained.models, more)
    save_variants(directory, trained.variants)


def learning_curve(train: Steps, others: Steps, seed: int) -> list[dict]:
    """RMSE along x on ``others`` over how many steps of ``train`` were fitted to; the mean of random choices."""
    rng, curve, count = np.random.default_rng([seed, 31]), [], FEWEST
    while count < len(train):
        draws = [fit_linear(train.chosen(rng.permutation(len(train))[:count])) for _ in range(_DRAWS)]
        curve.append({"steps": count, **_mean_rmse(draws, others)})
        count = round(1.5 * count)
    return [*curve, {"steps": len(train), **_mean_rmse([fit_linear(train)], others)}]


def _mean_rmse(fits: list[np.ndarray], steps: Steps) -> dict[str, float]:
    found = [figures(residuals_of(lambda x, fit=fit: x @ fit.T, steps), FORWARD) for fit in fits]
    return {name: round(float(np.mean([f[name]["rmse"] for f in found])), _DIGITS) for name in MODEL_NAMES}


def _rounded(residuals: np.ndarray) -> dict:
    """Figures of ``residuals`` along x and y, for a card."""
    return {
        axis: {name: {k: round(v, _DIGITS) for k, v in entry.items()} for name, entry in figures(residuals, columns).items()}
        for axis, columns in (("x", FORWARD), ("y", LEFT))
    }


def _footholds_ahead(train: Steps, others: Steps) -> dict[str, list[float]]:
    """By linear variant, fitted to ``train``: RMSE along x of footholds 1, 2 ... steps ahead on ``others`` [m]."""
    fits = {name: fit_variant(train, name) for name in LINEAR_VARIANTS}
    errors = {name: foothold_errors(lambda x, fit=fit: x @ fit.T, others) for name, fit in fits.items()}
    return {name: [round(value, _DIGITS) for value in rmse_by_step(found)] for name, found in errors.items()}


def _steps_of_all(directories: list[Path], split: str) -> Steps:
    """Steps of a split of several datasets; walks of different ones have different numbers."""
    parts = []
    for index, directory in enumerate(directories):
        steps = read_steps(directory, split, may_be_empty=True)
        parts.append(replace(steps, walk=steps.walk + 10_000 * index))
    return join_steps(parts)


def _check_alike(directories: list[Path], manifests: list[dict]) -> None:
    """Raises UserInputError if the datasets cannot be learned from together."""
    for key in ("robot", "gait", "settings"):
        for directory, manifest in zip(directories, manifests, strict=True):
            if manifest[key] != manifests[0][key]:
                what = "of another walk (settings)" if key == "settings" else f"of the {key} {manifest[key]}"
                raise UserInputError(f"--data {directory}: {what}, other than {directories[0]}; train them one by one")
    seeds = [manifest["seed"] for manifest in manifests]
    if len(set(seeds)) < len(seeds):
        raise UserInputError(f"--data: the datasets have seeds {', '.join(map(str, seeds))}; give each seed once")
