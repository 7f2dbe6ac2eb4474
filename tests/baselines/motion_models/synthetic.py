"""Walks that are linear by construction, as rows of data."""

import dataclasses
import json

import numpy as np

from quadpips_drake.baselines.motion_models.models import models_of_both_pairs
from quadpips_drake.baselines.motion_models.state import (
    BASE_SHIFT,
    COMMAND,
    CONSTANT,
    FEET,
    FEET_SHIFT,
    INPUTS,
    NEXT_VELOCITY,
    OUTPUTS,
    PAIRS,
    VELOCITY,
    StepState,
)
from quadpips_drake.baselines.motion_models.step_data import FORMAT, MANIFEST, VERSION
from quadpips_drake.baselines.motion_models.walk_settings import motion_models_walk, walk_settings
from quadpips_drake.control.mpc.mpc_config import walking_mpc
from quadpips_drake.diagrams.tracking_module import TrackingConfig

STEP = 0.3
NOMINAL = np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]])


def linear_walk(seed: int = 0) -> np.ndarray:
    """Coefficients (2, OUTPUTS, INPUTS) of a walk that holds together: feet go back below the base; the rest is chance."""
    rng = np.random.default_rng([seed, 7])
    first = 0.02 * rng.normal(size=(OUTPUTS, INPUTS))
    for axis in range(2):
        first[BASE_SHIFT.start + axis, [VELOCITY.start + axis, COMMAND.start + axis]] += 0.15
        first[NEXT_VELOCITY.start + axis, [VELOCITY.start + axis, COMMAND.start + axis]] += 0.4
        for foot, leg in enumerate(PAIRS[0]):
            row = FEET_SHIFT.start + 2 * foot + axis
            first[row, FEET.start + 2 * leg + axis] -= 0.9
            first[row, CONSTANT] += 0.9 * NOMINAL[leg, axis]
            first[row, COMMAND.start + axis] += 0.3
    return models_of_both_pairs(first)


def walk_rows(coefficients: np.ndarray, seed: int, steps: int = 60, noise: float = 0.0) -> dict[str, np.ndarray]:
    """Rows (``step_data.ROWS``) of a walk by these models under random commands."""
    rng = np.random.default_rng(seed)
    feet = NOMINAL + 0.02 * rng.normal(size=(4, 2))
    state = StepState(rng.normal(size=2), 1.0, np.zeros(2), np.zeros(2), np.zeros(3), feet, swing=seed % 2)
    rows = []
    for k in range(steps):
        command = rng.uniform([0.0, -0.2, -0.3], [1.0, 0.2, 0.3])
        x = state.inputs(command)
        rows.append(
            {
                **{"stamp": 1.0 + STEP * k, "swing": state.swing, "position": state.position, "yaw": state.yaw},
                **{"velocity": state.velocity, "feet": state.feet, "inputs": x, "out_of_standing": k == 0},
            }
        )
        state = state.after(command, coefficients[state.swing] @ x + noise * rng.normal(size=OUTPUTS))
        state = dataclasses.replace(state, yaw_rate=float(rng.normal()))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def write_data(directory, coefficients: np.ndarray, walks: int = 8, noise: float = 0.0, **changes) -> None:
    """Writes a dataset as 'motion-models collect' does; ``changes`` are of its manifest."""
    directory.mkdir(parents=True, exist_ok=True)
    splits = ("train", "train", "val", "train", "train", "test", "train", "train")
    manifest = {"format": FORMAT, "version": VERSION, "robot": "anymal_c", "gait": "trot", "seed": 1, "top_speed": 1.0}
    manifest["settings"] = walk_settings(motion_models_walk(), TrackingConfig(mpc=walking_mpc()))
    manifest["walks"] = [{"file": f"walk_{i:04d}.npz", "split": splits[i % len(splits)]} for i in range(walks)]
    (directory / MANIFEST).write_text(json.dumps(manifest | changes))
    for i in range(walks):
        np.savez(directory / f"walk_{i:04d}.npz", **walk_rows(coefficients, i, noise=noise))
