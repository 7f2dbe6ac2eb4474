"""Figures of walks: what each gait does with the feet, and how a robot gets over a push."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadpips_drake.gaits.gaits import Gait
from quadpips_drake.values.legs import Leg
from quadpips_drake.visualization.colors import LEG_COLORS


def gait_figure(gaits: list[Gait], span: float = 2.0, columns: int = 3) -> Figure:
    """Gait diagrams, one per gait: a bar where a foot is down, over ``span`` [s] from the beginning of a cycle."""
    rows = -(-len(gaits) // columns)
    figure = Figure(figsize=(4.0 * columns, 1.35 * rows + 0.4), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False).ravel()
    for axes, gait in zip(grid, gaits, strict=False):
        _draw_gait(axes, gait, span)
    for axes in grid[len(gaits) :]:
        axes.set_axis_off()
    for axes in grid[max(0, len(gaits) - columns) : len(gaits)]:
        axes.set_xlabel("time [s]")
        axes.tick_params(labelbottom=True)
    return figure


def _draw_gait(axes: Axes, gait: Gait, span: float) -> None:
    time = np.linspace(0.0, span, 2001)
    # Two cycles later the gait is in full swing: a foot that is in the air at the beginning of a cycle is shown so.
    schedule = gait.schedule(-2.0 * gait.duration, until=span + 2.0 * gait.duration)
    down = schedule.stance[np.searchsorted(schedule.event_times, time, side="right")]
    for leg in Leg:
        row = len(Leg) - 1 - int(leg)
        axes.fill_between(time, row - 0.36, row + 0.36, where=down[:, leg], color=LEG_COLORS[leg], linewidth=0)
    for cycle in np.arange(gait.duration, span - 1e-9, gait.duration):
        axes.axvline(cycle, color="0.6", linewidth=0.8, linestyle=":")
    axes.set_yticks(range(len(Leg)), [leg.name for leg in reversed(Leg)])
    axes.set_xlim(0.0, span)
    duty = down[time < gait.duration].mean()
    axes.set_title(f"{gait.name}: {gait.duration:g} s, feet down {duty:.0%}", fontsize=9)


def push_figure(log: Mapping, since: float, until: float) -> Figure:
    """A push and what follows: sideways velocity, tilt, sideways foot positions with the footholds, and normal forces.

    Args:
        log: arrays of a walk (log.npz) with the array ``push`` [N].
        since, until: [s]
    """
    time = np.asarray(log["time"])
    shown = (time >= since) & (time <= until)
    t = time[shown]
    figure = Figure(figsize=(10, 8), layout="constrained")
    speed, tilt, feet, forces = figure.subplots(4, 1, sharex=True)
    speed.plot(t, np.asarray(log["v_WB"])[shown, 1], color="black")
    speed.set_ylabel("base, y [m/s]")
    for axis, name, color in ((0, "roll", "tab:red"), (1, "pitch", "tab:blue")):
        tilt.plot(t, np.asarray(log["rpy_WB"])[shown, axis], label=name, color=color)
    tilt.set_ylabel("[rad]")
    tilt.legend(loc="upper right", fontsize=8)
    landed = np.asarray(log["foothold_touchdown"])
    inside = (landed >= since) & (landed <= until)
    for leg in Leg:
        color = LEG_COLORS[leg]
        feet.plot(t, np.asarray(log["foot_positions"])[shown, leg, 1], color=color, label=leg.name)
        mine = inside & (np.asarray(log["foothold_leg"]) == leg)
        feet.plot(landed[mine], np.asarray(log["foothold_position"])[mine, 1], "o", color=color, fillstyle="none")
        forces.plot(t, np.asarray(log["contact_forces"])[shown, leg, 2], color=color, linewidth=1.0)
    feet.plot(t, np.asarray(log["p_WB"])[shown, 1], color="black", label="base")
    feet.set_ylabel("y [m]")
    feet.legend(loc="upper right", fontsize=8, ncols=5)
    forces.set_ylabel("normal forces [N]")
    forces.set_xlabel("time [s]")
    pushed = time[np.abs(np.asarray(log["push"])).sum(axis=1) > 0.0]
    for axes in (speed, tilt, feet, forces):
        axes.grid(alpha=0.3)
        if len(pushed):
            axes.axvspan(pushed[0], pushed[-1], color="tab:orange", alpha=0.3)
    return figure
