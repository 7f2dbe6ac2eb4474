"""From swings to a network, with figures on walks that it has not learned from."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.learned_footholds.model_file import save_network
from quadpips_drake.baselines.learned_footholds.network import HIDDEN, OUTPUTS, FootholdNetwork
from quadpips_drake.baselines.learned_footholds.swing_data import SPLITS, Swings, read_swings, split_of
from quadpips_drake.baselines.learned_footholds.swing_view import INPUTS
from quadpips_drake.errors import UserInputError

EPOCHS = 40
"""Rounds over the data; what validates best is kept."""
FEWEST = 200
"""Swings to learn from [1]."""
_BATCH, _RATE, _DECAY = 64, 5e-4, 1.0
_LEAST_SCALE = 1e-2
"""Of an input, to divide by [m]: what hardly varies in the data shall not decide when it does."""


@dataclass(frozen=True, eq=False)
class TrainedFootholds:
    """What a training gives."""

    network: FootholdNetwork
    card: dict
    """Where it comes from, and its figures."""
    epochs: list[dict]
    """{"epoch", "train", "val"}: mean distances to the search's footholds [m]."""


def train_footholds(
    directory: Path, seed: int, on_epoch: Callable[[int, float], None] = lambda *_: None
) -> TrainedFootholds:
    """Learns from the data in ``directory``.

    Args:
        directory: what 'learned-footholds collect' has written.
        seed: of initial weights and order.
        on_epoch: called after each epoch with its number and the mean distance on the walks of validation [m].

    Raises:
        UserInputError: data are missing, damaged or too few.
    """
    swings, manifest = read_swings(directory)
    parts = {split: split_of(swings, manifest, split) for split in SPLITS}
    if len(parts["train"]) < FEWEST or not len(parts["val"]) or not len(parts["test"]):
        raise UserInputError(f"--data {directory}: {len(parts['train'])} swings are too few; collect more rounds")
    arrays, epochs = _fit(parts["train"], parts["val"], seed, on_epoch)
    network = FootholdNetwork(manifest["robot"], manifest["cell"], **arrays)
    card = {
        "data": {"seed": manifest["seed"], "swings": {name: len(part) for name, part in parts.items()}},
        "seed": seed,
        "held_out": figures(network, parts["test"]),
    }
    return TrainedFootholds(network, card, epochs)


def save_training(directory: Path, trained: TrainedFootholds) -> None:
    """Writes the network and its card."""
    save_network(directory, trained.network, trained.card)


def figures(network: FootholdNetwork, swings: Swings) -> dict[str, dict[str, float]]:
    """Distances to the footholds of the search [m], of: the wish as it is, the nearest foothold to it, the network."""
    guesses = {"wish": 0.0 * swings.offsets, "nearest": swings.nearest, "network": network.offsets(swings.inputs)}
    return {name: _distances(guess - swings.offsets) for name, guess in guesses.items()}


def _distances(errors: np.ndarray) -> dict[str, float]:
    distances = np.hypot(*errors.T.astype(float))
    low, high = np.quantile(distances, (0.5, 0.9))
    return {"mean": round(float(distances.mean()), 4), "median": round(float(low), 4), "p90": round(float(high), 4)}


def _fit(train: Swings, val: Swings, seed: int, on_epoch) -> tuple[dict[str, np.ndarray], list[dict]]:
    """The arrays of the network that is best on ``val``, and the course of the training."""
    import torch
    from torch import nn

    mean, scale = train.inputs.mean(axis=0), np.maximum(train.inputs.std(axis=0), _LEAST_SCALE)
    (x, y), (x_val, y_val) = (
        (torch.from_numpy((part.inputs - mean) / scale), torch.from_numpy(part.offsets)) for part in (train, val)
    )
    rng, threads = torch.Generator().manual_seed(seed), torch.get_num_threads()
    torch.set_num_threads(1)  # sums have one order
    try:
        layers = nn.Linear(INPUTS, HIDDEN), nn.Tanh(), nn.Linear(HIDDEN, HIDDEN), nn.Tanh(), nn.Linear(HIDDEN, OUTPUTS)
        network = nn.Sequential(*layers)
        for layer in network[::2]:
            nn.init.xavier_uniform_(layer.weight, generator=rng)
            nn.init.zeros_(layer.bias)
        nn.init.zeros_(network[-1].weight)  # before it has learned anything, the wish is as good as any
        optimizer = torch.optim.AdamW(network.parameters(), lr=_RATE, weight_decay=_DECAY)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, EPOCHS)
        epochs, kept = [], None
        for epoch in range(1, EPOCHS + 1):
            loss = _epoch(network, optimizer, x, y, torch.randperm(len(x), generator=rng))
            schedule.step()
            with torch.no_grad():
                error = float(_distance(network(x_val), y_val))
            if kept is None or error < min(entry["val"] for entry in epochs):
                kept = [array.numpy().copy() for array in network.state_dict().values()]
            epochs.append({"epoch": epoch, "train": round(loss, 5), "val": round(error, 5)})
            on_epoch(epoch, error)
    finally:
        torch.set_num_threads(threads)
    arrays = {"mean": mean, "scale": scale}
    for number, (matrix, bias) in enumerate(zip(kept[::2], kept[1::2], strict=True), start=1):
        arrays |= {f"matrix_{number}": matrix.T, f"bias_{number}": bias}
    # As in a file, so that a network is the same before and after it was written.
    return {name: np.ascontiguousarray(array, np.float32).astype(float) for name, array in arrays.items()}, epochs


def _epoch(network, optimizer, x, y, order) -> float:
    """One round; returns the mean distance."""
    total = 0.0
    for chosen in order.split(_BATCH):
        loss = _distance(network(x[chosen]), y[chosen])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        total += float(loss.detach()) * len(chosen)
    return total / len(order)


def _distance(guess, truth):
    """Mean distance: unlike its square it takes one of two footholds rather than the middle between them."""
    return ((guess - truth) ** 2).sum(dim=1).add(1e-8).sqrt().mean()
