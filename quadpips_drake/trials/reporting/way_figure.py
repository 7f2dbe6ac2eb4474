"""The way of a trial from above, with what has appeared and where it began to go wrong."""

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from quadpips_drake.trials.reporting.case import Case, Finding
from quadpips_drake.trials.reporting.overview_figure import thinned
from quadpips_drake.visualization.plots import path_figure

_FIRST_COLOR, _APPEARED_COLOR = (0.85, 0.10, 0.15), "tab:orange"


def way_figure(case: Case, first: Finding | None = None) -> Figure:
    """Returns the picture of the way over the terrain; a cross is where the base was when ``first`` began."""
    log = thinned(case.log)
    figure = path_figure(log, case.record.terrain, goal=not case.record.is_walk)
    (axes,) = figure.axes
    log = case.log
    for low, high in zip(log.get("appeared_low", ()), log.get("appeared_high", ()), strict=True):
        width, height = high[:2] - low[:2]
        label = f"appeared, {high[2] - low[2]:.2f} m high"
        axes.add_patch(
            Rectangle(low[:2], width, height, facecolor=_APPEARED_COLOR, alpha=0.7, edgecolor="black", zorder=4, label=label)
        )
    end = log["p_WB"][-1]
    axes.plot(*end[:2], "s", color="black", markersize=7, fillstyle="none", zorder=9, label="end")
    if first is not None:
        axes.plot(*case.position(first.time)[:2], "X", color=_FIRST_COLOR, markersize=10, zorder=10, label=first.cause)
    axes.legend(loc="upper left", fontsize=8, framealpha=0.9)
    return figure
