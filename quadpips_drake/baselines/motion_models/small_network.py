"""A small network in the place of the linear models, to see whether what is not linear brings anything."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from quadpips_drake.baselines.motion_models.state import CONSTANT, INPUTS, OUTPUTS
from quadpips_drake.baselines.motion_models.step_data import Steps

HIDDEN = 24
"""Units of each of two layers."""
LAYER_SHAPES = [(INPUTS - 1, HIDDEN), (HIDDEN,), (HIDDEN, HIDDEN), (HIDDEN,), (HIDDEN, OUTPUTS), (OUTPUTS,)]
"""Matrix and bias of each layer; the constant is no input."""
EPOCHS = 400
"""Rounds over the data; what validates best is kept."""
_BATCH, _RATE, _DECAY = 64, 3e-3, 1e-4
LEAST_SCALE = 1e-6
"""Of an input or output, to divide by."""


@dataclass(frozen=True, eq=False)
class NetworkModel:
    """Two layers of tanh units between scaled inputs and outputs; runs without torch."""

    input_mean: np.ndarray
    input_scale: np.ndarray
    output_mean: np.ndarray
    output_scale: np.ndarray
    weights: tuple[np.ndarray, ...]
    """Matrix and bias of each layer, in order: (in, out), (out,), ..."""

    def predict_first(self, x: np.ndarray) -> np.ndarray:
        """Outputs (n, OUTPUTS) of swing 0 for inputs (n, INPUTS)."""
        h = (np.delete(x, CONSTANT, axis=1) - self.input_mean) / self.input_scale
        matrices, biases = self.weights[::2], self.weights[1::2]
        for matrix, bias in zip(matrices[:-1], biases[:-1], strict=True):
            h = np.tanh(h @ matrix + bias)
        return (h @ matrices[-1] + biases[-1]) * self.output_scale + self.output_mean

    @property
    def parameters(self) -> int:
        """How many numbers were learned."""
        return sum(array.size for array in self.weights)


def fit_network(
    train: Steps, val: Steps, seed: int, on_epoch: Callable[[int, float, float], None] = lambda *_: None
) -> tuple[NetworkModel, list[dict]]:
    """Trains on ``train``, keeps what is best on ``val``; returns the model and {"epoch", "train", "val"} of each epoch.

    Args:
        train: steps to learn from.
        val: other walks' steps.
        seed: of initial weights and order.
        on_epoch: called after each epoch with its number and the losses (mean squared error of scaled outputs).
    """
    import torch
    from torch import nn

    x, y = _without_constant(train)
    scales = [f for part in (x, y) for f in (part.mean(axis=0), np.maximum(part.std(axis=0), LEAST_SCALE))]
    data = _tensors(x, y, scales), _tensors(*_without_constant(val), scales)
    rng = torch.Generator().manual_seed(seed)
    network = nn.Sequential(
        nn.Linear(x.shape[1], HIDDEN), nn.Tanh(), nn.Linear(HIDDEN, HIDDEN), nn.Tanh(), nn.Linear(HIDDEN, OUTPUTS)
    ).double()
    for layer in network[::2]:
        nn.init.xavier_uniform_(layer.weight, generator=rng)
        nn.init.zeros_(layer.bias)
    optimizer = torch.optim.AdamW(network.parameters(), lr=_RATE, weight_decay=_DECAY)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, EPOCHS)
    history, best, kept = [], np.inf, None
    for epoch in range(1, EPOCHS + 1):
        total = _epoch(network, optimizer, data[0], torch.randperm(len(x), generator=rng))
        schedule.step()
        with torch.no_grad():
            loss = float(((network(data[1][0]) - data[1][1]) ** 2).mean())
        history.append({"epoch": epoch, "train": round(total, 5), "val": round(loss, 5)})
        if loss < best:
            best, kept = loss, [array.numpy().copy() for array in network.state_dict().values()]
        on_epoch(epoch, total, loss)
    weights = tuple(array.T if array.ndim == 2 else array for array in kept)
    return NetworkModel(*scales, weights), history


def _epoch(network, optimizer, data, order) -> float:
    """One round; returns the mean loss."""
    total = 0.0
    for chosen in order.split(_BATCH):
        loss = ((network(data[0][chosen]) - data[1][chosen]) ** 2).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        total += float(loss.detach()) * len(chosen)
    return total / len(order)


def _without_constant(steps: Steps) -> tuple[np.ndarray, np.ndarray]:
    x, y = steps.as_one_pair()
    return np.delete(x, CONSTANT, axis=1), y


def _tensors(x, y, scales):
    import torch

    return torch.from_numpy((x - scales[0]) / scales[1]), torch.from_numpy((y - scales[2]) / scales[3])
