"""The page of the offline experiment: what becomes of trial after trial, in each mode."""

import numpy as np
from matplotlib.figure import Figure

from quadpips_drake.benchmark.experience.experience_study import Series, failures_before_success

PICTURE = "experience.png"
_PANELS = (
    ("path cost of the plans [m]", lambda row: row["path_cost"]),
    ("longest foothold search [ms]", lambda row: max(row["search_ms"], default=np.nan)),
    ("swing optimisation [s]", lambda row: 1e-3 * row["optimization_ms"]),
)
"""Titles and values by trial of all panels but the first."""


def experience_figure(series: list[Series], results: dict, trials: int) -> Figure:
    """Goals, path cost, search and optimisation time by trial; a line for each mode, thin ones for its repeats."""
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    axes = figure.subplots(2, 2).ravel()
    titles = list(dict.fromkeys(one.title for one in series))
    for number, title in enumerate(titles):
        found = [results[one.key]["rows"] for one in series if one.title == title and one.key in results]
        if found:
            _draw(axes, (f"C{number}", 5.0 - 0.7 * number), title, found, trials)
    axes[0].set_ylabel("repeats that reached the goal [%]")
    axes[0].set_ylim(-5, 105)
    axes[0].legend(fontsize="small", loc="center right")
    for panel, (title, _) in zip(axes[1:], _PANELS, strict=True):
        panel.set_ylabel(title)
    for panel in axes:
        panel.set_xlabel("trial")
        panel.set_xscale("log")
        last = _last_trial(results, series)
        panel.set_xlim(0.9, max(1.1 * last, 2.0))
        shown = [number for number in (1, 2, 5, 10, 20, 50, 100, 200, 500) if number <= max(last, 2)]
        panel.set_xticks(shown, [str(number) for number in shown])
        panel.minorticks_off()
        panel.grid(alpha=0.3)
    return figure


def _draw(axes, style: tuple[str, float], title: str, found: list[list[dict]], trials: int) -> None:
    """The curves of one mode; ``style`` is its color and the width of its line of goals, since these lie on each other."""
    color, width = style
    won = [failures_before_success(rows) for rows in found]
    numbers = np.arange(1, trials + 1)
    share = [100.0 * np.mean([count is not None and count < k for count in won]) for k in numbers]
    axes[0].step(numbers, share, where="mid", color=color, linewidth=width, label=title)
    for panel, (_, value) in zip(axes[1:], _PANELS, strict=True):
        for rows in found:
            values = [value(row) for row in rows]
            panel.plot(np.arange(1, len(rows) + 1), values, color=color, linewidth=0.8, alpha=0.6)
            if rows[-1]["result"] == "goal":
                panel.plot(len(rows), values[-1], "o", color=color, markersize=4)


def _last_trial(results: dict, series: list[Series]) -> int:
    """The last trial that was run in any of them."""
    return max((len(results[one.key]["rows"]) for one in series if one.key in results), default=1)
