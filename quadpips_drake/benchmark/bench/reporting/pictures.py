"""The pictures of a bench: goals reached and progress over time, computing times, success against difficulty."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadpips_drake.benchmark.bench.reporting.published import TRIALS, goals_reached
from quadpips_drake.benchmark.bench.reporting.summary import stage_timings
from quadpips_drake.benchmark.bench.reporting.sweep import difficulty_title, sweeps_of
from quadpips_drake.benchmark.bench.scores import grouped, score_of

DPI = 90


def pictures_of(rows: list[dict]) -> Iterator[tuple[str, str, Figure]]:
    """Yields file name, title and picture of all that there is to show."""
    for (robot,), group in grouped(rows, ("robot",)).items():
        name = Path(robot).parent.name if Path(robot).suffix else robot
        yield f"progress-{name}.png", f"Progress over time, {name}", progress_figure(group)
        if any(row["timings_ms"] for row in group):
            yield f"timings-{name}.png", f"Computing time, {name}", timings_figure(group)
    if sweeps_of(rows):
        yield "difficulty.png", "Success against difficulty, curves", difficulty_figure(rows)


def progress_figure(rows: list[dict]) -> Figure:
    """Figure 14 of the paper: for each terrain the share of goals reached, and progress over time of each trial.

    Solid lines are successes, dashed ones failures, which end in a cross. Grey marks are the paper's counts.
    """
    terrains = grouped(rows, ("terrain",))
    planners = {planner: f"C{k}" for k, (planner,) in enumerate(grouped(rows, ("planner",)))}
    figure = Figure(figsize=(9.0, 0.6 + 2.0 * len(terrains)), layout="constrained")
    panels = figure.subplots(len(terrains), 2, squeeze=False, width_ratios=(0.3 + 0.6 * len(planners), 4))
    for ((terrain,), group), (rates, curves) in zip(terrains.items(), panels, strict=True):
        for k, (planner, color) in enumerate(planners.items()):
            _draw_rate(rates, k, [row for row in group if row["planner"] == planner], color)
            for count in goals_reached(group[0]["robot"], planner, terrain, group[0]["difficulty"]):
                rates.plot([k - 0.45, k + 0.45], 2 * [count / TRIALS], color="0.3", linewidth=1.5, linestyle=":")
        rates.set(ylim=(0.0, 1.05), xticks=range(len(planners)), xlim=(-0.6, len(planners) - 0.4), ylabel="goals reached")
        rates.set_xticklabels(planners, fontsize="small")
        for row in group:
            _draw_progress(curves, row, planners[row["planner"]])
        curves.set_title(Path(terrain).stem, fontsize="medium", loc="left")
        curves.set(ylim=(-0.03, 1.05), xlim=(0.0, None), ylabel="progress")
        curves.grid(alpha=0.3)
    panels[-1, 1].set_xlabel("simulated time [s]   (solid: goal reached; dashed: not; dotted at the left: the paper)")
    return figure


def _draw_rate(axes: Axes, place: int, rows: list[dict], color: str) -> None:
    """A bar with its interval."""
    if not rows:
        return
    score = score_of(rows)
    low, high = score.interval
    axes.bar(place, score.rate, width=0.6, color=color, alpha=0.6)
    axes.errorbar(place, score.rate, [[score.rate - low], [high - score.rate]], color="black", capsize=4, linewidth=1)
    axes.text(place, 0.04, f"{score.reached}/{score.trials}", ha="center", fontsize="small")


def _draw_progress(axes: Axes, row: dict, color: str) -> None:
    """The curve of one trial."""
    if not row["progress"]:
        return
    time, fraction = np.array(row["progress"], dtype=float).T
    line = "-" if row["success"] else "--"
    axes.plot(time, fraction, line, color=color, linewidth=1.0, alpha=0.8)
    if not row["success"]:
        axes.plot(time[-1], fraction[-1], "x", color=color, markersize=6)


def timings_figure(rows: list[dict]) -> Figure:
    """Figure 12 of the paper: mean computing time of each stage, and its 95th percentile; a panel for each planner."""
    groups = grouped((row for row in rows if row["timings_ms"]), ("planner",))
    timings = {planner: stage_timings(group) for (planner,), group in groups.items()}
    height = max(len(stages) for stages in timings.values())
    figure = Figure(figsize=(9.0, len(timings) * (1.2 + 0.26 * height)), layout="constrained")
    panels = figure.subplots(len(timings), 1, squeeze=False)[:, 0]
    for axes, (planner, stages) in zip(panels, timings.items(), strict=True):
        ranked = sorted(stages.items(), key=lambda item: item[1]["mean"])
        names = [f"{name.replace('_', ' ')}  (n = {timing['calls']})" for name, timing in ranked]
        means, highs = ([timing[figure] for _, timing in ranked] for figure in ("mean", "p95"))
        axes.barh(names, means, color="C0", alpha=0.7, label="mean")
        axes.plot(highs, names, "|", color="black", markersize=12, label="95th percentile, median of the trials")
        axes.set(xscale="log", xlabel="computing time of one call [ms]", title=planner)
        axes.grid(alpha=0.3, axis="x")
        axes.legend(fontsize="small", loc="lower right")
    return figure


def difficulty_figure(rows: list[dict]) -> Figure:
    """Success against difficulty with intervals, and where half succeed; a panel for each terrain."""
    panels_of: dict[str, list] = {}
    for (robot, terrain, planner), sweep in sweeps_of(rows).items():
        panels_of.setdefault(terrain, []).append((f"{Path(robot).stem}, {planner}", sweep))
    columns = min(len(panels_of), 2)
    lines = -(-len(panels_of) // columns)
    figure = Figure(figsize=(5.0 * columns, 3.4 * lines), layout="constrained")
    panels = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes in panels[len(panels_of) :]:
        axes.set_visible(False)
    for axes, (terrain, sweeps) in zip(panels, panels_of.items(), strict=False):
        for k, (label, sweep) in enumerate(sweeps):
            low, high = np.array([score.interval for score in sweep.scores]).T
            half = sweep.half()
            label += "" if half is None else f": half at {half:.3g}"
            errors = [sweep.rates - low, high - sweep.rates]
            beside = sweep.difficulties + 0.008 * k * np.ptp(sweep.difficulties)  # so that intervals can be told apart
            axes.errorbar(beside, sweep.rates, errors, marker="o", linestyle="", capsize=3, color=f"C{k}")
            axes.plot(sweep.difficulties, sweep.fitted(), color=f"C{k}", label=label)
            if half is not None:
                axes.plot(half, 0.5, "D", color=f"C{k}", markeredgecolor="black", markersize=7)
        axes.axhline(0.5, color="0.6", linewidth=0.8)
        axes.set(ylim=(-0.04, 1.04), xlabel=difficulty_title(terrain), ylabel="goals reached")
        axes.set_title(Path(terrain).stem, fontsize="medium", loc="left")
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small", loc="best")
    return figure
