"""The page of the study of growth: computing time and memory against size, on logarithmic scales, with fitted powers."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadpips_drake.benchmark.growth import EXPONENTS, FAMILIES, MEMORY, PICTURE, curves, exponents, power_of, upper_half
from quadpips_drake.files import write_json


def growth_figure(results: dict, names: list[str], *, quick: bool = False) -> Figure:
    """A column for each family: CPU time above, memory below; dashed lines are the fitted powers, over what they fit."""
    figure = Figure(figsize=(4.6 * len(names), 8.5), layout="constrained")
    axes = figure.subplots(2, len(names), squeeze=False, height_ratios=(2, 1), sharex="col")
    for column, name in enumerate(names):
        times, memory = axes[:, column]
        for curve, points in curves(results, name, quick=quick).items():
            _draw(memory if curve == MEMORY else times, curve, *points)
        memory.set_xlabel(FAMILIES[name].counted)
        for panel in (times, memory):
            panel.grid(alpha=0.3)
            if panel.has_data():
                panel.legend(fontsize="small")
    axes[0, 0].set_ylabel("CPU time [s]")
    axes[1, 0].set_ylabel("memory [MB]")
    return figure


def _draw(axes: Axes, curve: str, sizes: np.ndarray, values: np.ndarray) -> None:
    """One curve with its power."""
    power = power_of(curve, sizes, values)
    label = curve if power is None else f"{curve}: $n^{{{power[1]:.2f}}}$"
    (line,) = axes.loglog(sizes, np.where(values > 0.0, values, np.nan), marker="o", markersize=4, label=label)
    if power is not None:
        fitted = sizes[upper_half(sizes)]
        axes.loglog(fitted, power[0] * fitted ** power[1], linestyle="--", linewidth=1, color=line.get_color())


def save_report(results: dict, names: list[str], folder: Path, *, quick: bool = False) -> None:
    """Writes exponents and curves of the families ``names`` into ``folder``."""
    write_json(folder / EXPONENTS, exponents(results, names, quick=quick))
    growth_figure(results, names, quick=quick).savefig(folder / PICTURE, dpi=100)
