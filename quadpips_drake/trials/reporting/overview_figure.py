"""A whole trial on one time axis: what it was about, what happened, base, torques, forces and controllers."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadpips_drake.gaits.gaits import gait_names, gait_number
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.trials.reporting.case import Case, Finding
from quadpips_drake.trials.reporting.measurements import impulses_of, outages_of
from quadpips_drake.trials.watching.notes import PLAN, SAFETY, STABLE_AGAIN
from quadpips_drake.values.legs import JOINTS_PER_LEG, Leg
from quadpips_drake.values.status import PlannerPhase
from quadpips_drake.visualization.colors import BASE_REFERENCE_COLOR, LEG_COLORS
from quadpips_drake.visualization.plots import draw_gait

MOST_SAMPLES = 3000
"""So many samples are drawn of an array; more would not be seen and cost time."""
_BANDS = ("#d7dde4", "#b9d3ea", "#cfe8cf", "#f2e2b8", "#f3c9bd", "#cdeedd", "#e3a9a9")
"""Colours of the planner's phases."""
_FIRST_COLOR, _PLAN_COLOR, _FALLBACK_COLOR, _PUSH_COLOR = (0.85, 0.10, 0.15), "0.25", "tab:purple", "tab:orange"
_MOST_MARKS = 400
"""So many marks of one kind are drawn."""


def overview_figure(case: Case, first: Finding | None = None) -> Figure:
    """Returns rows over time; ``first``: where the report says that it began, a red line across all of them."""
    log = thinned(case.log)
    time = log["time"]
    figure = Figure(figsize=(12.0, 10.5), layout="constrained")
    heights = [1.1, 1.0, 0.9, 0.9, 1.1, 0.8]
    rows = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    _draw_bands(rows[0], case, log)
    draw_gait(rows[1], time, log["contacts"])
    _draw_height(rows[2], log)
    _draw_tilt(rows[3], log)
    _draw_loads(rows[4], case, log)
    _draw_control(rows[5], case, log)
    for axes in rows:
        if first is not None:
            axes.axvline(max(first.time, time[0]), color=_FIRST_COLOR, linewidth=1.5, zorder=6)
        for begin, end, _ in impulses_of(case.record):
            axes.axvspan(begin, end, color=_PUSH_COLOR, alpha=0.4, zorder=0)
    for axes in rows[1:]:
        axes.grid(alpha=0.3)
    rows[-1].set_xlabel("time t [s]")
    rows[-1].set_xlim(time[0], max(time[-1], time[0] + 0.01))
    figure.align_ylabels(rows)
    return figure


def thinned(log: Mapping[str, np.ndarray], most: int = MOST_SAMPLES) -> dict[str, np.ndarray]:
    """The log with every n-th sample, so that at most ``most`` remain and the last; other arrays as they are."""
    samples = len(log["time"])
    if samples <= most:
        return dict(log)
    kept = np.unique(np.append(np.arange(0, samples, -(-samples // most)), samples - 1))
    whole = ("foothold_", "note_", "appeared_")
    return {name: array if name.startswith(whole) else array[kept] for name, array in log.items()}


def _draw_bands(axes: Axes, case: Case, log: Mapping) -> None:
    """Phases of the planner, or the gait that was commanded; plans, fallbacks, instabilities and what appeared as marks."""
    if "phase" in log:
        phases = list(PlannerPhase)
        names = {k: str(phase).replace("_", " ") for k, phase in enumerate(phases)}
        _draw_spans(axes, log["time"], log["phase"], names)
        axes.set_ylabel("phase")
    elif "gait" in log:
        _draw_spans(axes, log["time"], log["gait"], {gait_number(name): name for name in gait_names()})
        axes.set_ylabel("gait")
    marks = {
        "plan": ([time for time, text in case.notes(PLAN) if ": none" not in text], "v", _PLAN_COLOR),
        "no plan": ([time for time, text in case.notes(PLAN) if ": none" in text], "X", _FIRST_COLOR),
        "unstable": ([time for time, text in case.notes(SAFETY) if text != STABLE_AGAIN], "*", _FIRST_COLOR),
        "solver failed": ([o.begin for name in ("mpc", "wbc") for o in outages_of(case.record, name)], "s", _FALLBACK_COLOR),
        "appeared": (list(case.log.get("appeared_time", ())), "D", _PUSH_COLOR),
        "event of the end": ([event.time for event in case.chain], "|", "black"),
    }
    shown = {name: mark for name, mark in marks.items() if mark[0]}
    for level, (name, (times, marker, color)) in enumerate(shown.items()):
        height = -0.25 - 0.3 * level
        axes.plot(times[:_MOST_MARKS], np.full(min(len(times), _MOST_MARKS), height), marker, color=color, label=name)
    axes.set_ylim(-0.2 - 0.3 * len(shown), 1.05)
    axes.set_yticks([-0.25 - 0.3 * level for level in range(len(shown))], list(shown), fontsize=7)


def _draw_spans(axes: Axes, time: np.ndarray, numbers: np.ndarray, names: dict[int, str]) -> None:
    """A coloured band for each stretch with the same number, with its name where there is room."""
    edges = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(numbers)]
    span = max(float(time[-1] - time[0]), 1e-6)
    for a, b in pairwise(edges):
        begin, end = time[a], time[min(b, len(time) - 1)]
        axes.axvspan(begin, end, 0.0, 1.0, color=_BANDS[int(numbers[a]) % len(_BANDS)], linewidth=0, zorder=0)
        name = names.get(int(numbers[a]), "?")
        if end - begin > 0.009 * span * len(name):
            axes.text(0.5 * (begin + end), 0.55, name, ha="center", va="center", fontsize=8)


def _draw_height(axes: Axes, log: Mapping) -> None:
    axes.plot(log["time"], log["p_WB"][:, 2], color="black", linewidth=1.2, label="measured")
    if "reference_p_WB" in log:
        axes.plot(log["time"], log["reference_p_WB"][:, 2], "--", color=BASE_REFERENCE_COLOR, linewidth=1.0, label="asked")
    axes.set_ylabel("base z [m]")
    axes.legend(loc="upper left", fontsize=7, ncols=2)


def _draw_tilt(axes: Axes, log: Mapping) -> None:
    for i, (name, color) in enumerate((("roll", "tab:red"), ("pitch", "tab:blue"))):
        axes.plot(log["time"], np.rad2deg(log["rpy_WB"][:, i]), color=color, linewidth=1.0, label=name)
    axes.set_ylabel("tilt [deg]")
    axes.legend(loc="upper left", fontsize=7, ncols=2)


def _draw_loads(axes: Axes, case: Case, log: Mapping) -> None:
    """Of each leg the torque that is nearest to its limit; and the weight on all feet as part of the robot's."""
    robot = case.record.robot
    if robot is None:
        axes.text(0.5, 0.5, "the robot is not at hand", transform=axes.transAxes, ha="center", va="center")
        return
    parts = np.abs(log["joint_torques"]) / robot.effort_limits
    for leg in Leg:
        largest = parts[:, JOINTS_PER_LEG * leg : JOINTS_PER_LEG * (leg + 1)].max(axis=1)
        axes.plot(log["time"], largest, color=LEG_COLORS[leg], linewidth=0.8, label=f"{leg.name} torque / limit")
    weight = log["contact_forces"][:, :, 2].sum(axis=1) / (GRAVITY * robot.mass)
    axes.plot(log["time"], weight, color="0.55", linewidth=0.7, zorder=1, label="load on the feet / weight")
    axes.axhline(1.0, color=BASE_REFERENCE_COLOR, linestyle="--", linewidth=0.9)
    axes.set_ylim(0.0, 2.0)
    axes.set_ylabel("loads [1]")
    axes.legend(loc="upper left", fontsize=7, ncols=5)


def _draw_control(axes: Axes, case: Case, log: Mapping) -> None:
    """How old the MPC's policy is, and what the camera knows."""
    if "mpc_age" not in log:
        axes.text(0.5, 0.5, "not in this log", transform=axes.transAxes, ha="center", va="center")
        return
    axes.plot(log["time"], 1e3 * log["mpc_age"], color="tab:purple", linewidth=0.8)
    axes.set_ylabel("age of MPC\npolicy [ms]")
    axes.set_ylim(0.0, max(60.0, 1.1e3 * float(np.nanmax(log["mpc_age"], initial=0.0))))
    if "region_labels" in log:
        other = axes.twinx()
        other.plot(log["time"], log["region_labels"].sum(axis=1), color="tab:green", linewidth=0.9)
        other.set_ylabel("regions", color="tab:green")
        other.set_ylim(bottom=0.0)
