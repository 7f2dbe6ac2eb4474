"""Predictions against what happened, as a picture."""

from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.models import MotionModels
from quadpips_drake.baselines.motion_models.scores import FORWARD, UNITS
from quadpips_drake.baselines.motion_models.state import COMMAND, NEXT_VELOCITY
from quadpips_drake.baselines.motion_models.step_data import Steps

_WORDS = {"cdm": "displacement of the base", "fdm": "displacement of the swing feet", "cvm": "velocity"}


def save_prediction_picture(models: MotionModels, steps: Steps, path: Path) -> None:
    """Draws how a walk follows its commands and what was predicted a step ahead, and predictions over measurements; PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplot_mosaic([["walk"] * 3, ["cdm", "fdm", "cvm"]], height_ratios=[1.0, 1.15])
    predicted = models.predict(steps.inputs, steps.swing)
    _draw_walk(axes["walk"], steps, predicted, models.step_duration)
    for name, columns in FORWARD.items():
        measured, told = steps.outputs[:, columns].ravel(), predicted[:, columns].ravel()
        ends = [min(measured.min(), told.min()), max(measured.max(), told.max())]
        axes[name].plot(ends, ends, color="0.7", linewidth=1)
        axes[name].plot(measured, told, ".", markersize=4)
        mae = np.abs(told - measured).mean()
        axes[name].set_title(f"{name.upper()}: {_WORDS[name]}\nMAE {mae:.4f} {UNITS[name]}", fontsize=10)
        axes[name].set(xlabel=f"measured along x [{UNITS[name]}]", ylabel="predicted", aspect="equal")
        axes[name].grid(alpha=0.3)
    figure.suptitle(f"{models.robot} in {models.gait}: {len(steps)} held-out steps")
    figure.savefig(path, dpi=90)


def _draw_walk(axes, steps: Steps, predicted: np.ndarray, duration: float) -> None:
    """The first walk: command, velocity at each exchange, and what was predicted one step before."""
    first = np.flatnonzero(steps.walk == steps.walk[0])
    forward = NEXT_VELOCITY.start
    times = duration * np.arange(len(first) + 1)
    commands = steps.inputs[first, COMMAND.start]
    axes.step(times, [*commands, commands[-1]], where="post", color="0.4", linewidth=1, label="commanded")
    axes.plot(times[1:], steps.outputs[first, forward], "k.-", label="measured at the exchange")
    axes.plot(times[1:], predicted[first, forward], "x", color="tab:red", label="predicted a step before")
    axes.set(xlabel="time [s]", ylabel="forward velocity [m/s]")
    axes.legend(loc="upper right")
    axes.grid(alpha=0.3)
