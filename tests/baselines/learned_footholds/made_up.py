"""Networks and data of footholds whose answers are known."""

from pathlib import Path

import numpy as np

from quadpips_drake.baselines.learned_footholds.network import SHAPES, FootholdNetwork
from quadpips_drake.baselines.learned_footholds.swing_data import Swings, save_swings
from quadpips_drake.baselines.learned_footholds.swing_view import INPUTS

WAY = slice(INPUTS - 3, INPUTS - 1)
"""Inputs: the way of the base within the swing."""


def constant_network(offset=(0.0, 0.0), robot: str = "anymal_c", cell: float = 0.04) -> FootholdNetwork:
    """One that always says the same."""
    arrays = {name: np.zeros(shape) for name, shape in SHAPES.items()}
    arrays |= {"scale": np.ones(INPUTS), "bias_3": np.array(offset, dtype=np.float32).astype(float)}
    return FootholdNetwork(robot, cell, **arrays)


def write_swings(directory: Path, count: int = 600, seed: int = 0) -> None:
    """Data in which a foot comes down half the way further than it was wished, and 3 cm further out on high ground."""
    rng, splits = np.random.default_rng(seed), ("train", "train", "val", "test")
    inputs = np.zeros((count, INPUTS), np.float32)
    inputs[:, WAY], inputs[:, 0] = rng.uniform(-0.1, 0.1, (count, 2)), rng.choice((-0.1, 0.1), count)
    offsets = 0.5 * inputs[:, WAY] + [0.0, 0.03] * np.sign(inputs[:, :1])
    swings = Swings(inputs, offsets.astype(np.float32), np.zeros((count, 2), np.float32), np.arange(count) % len(splits))
    walks = [{"terrain": "flat", "seed": 1000 + k, "split": split} for k, split in enumerate(splits)]
    directory.mkdir(parents=True, exist_ok=True)
    save_swings(directory, swings, {"robot": "anymal_c", "cell": 0.04, "seed": 1000, "walks": walks})
