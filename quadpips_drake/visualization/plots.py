"""Plots of a trial's log (log.npz): the way over the terrain, base, feet and contacts, torques.

A log is a mapping of arrays with the sample as first axis: `time` [s], `p_WB` [m], `rpy_WB` [rad], `joint_positions`,
`joint_torques` [N m], `contacts`, `contact_forces` [N], `foot_positions` [m], `reference_p_WB` [m]; optional are
`foothold_leg` and `foothold_position` of the planned footholds. A plot leaves out what a log does not hold.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.legs import JOINTS_PER_LEG, Leg
from quadpips_drake.visualization.colors import BASE_REFERENCE_COLOR, LEG_COLORS
from quadpips_drake.visualization.terrain_picture import draw_goal, draw_start, draw_terrain, view_of

JOINT_KINDS = ("HAA", "HFE", "KFE")
_REFERENCE_STYLE = {"color": BASE_REFERENCE_COLOR, "linestyle": "--", "linewidth": 1.0}


def save_plots(log: Mapping, directory: str | Path, *, terrain: Terrain | None = None, robot=None) -> list[Path]:
    """Writes path.png, base.png, feet.png and torques.png into ``directory``; returns their paths.

    Args:
        log: arrays of the trial, as returned by ``numpy.load`` of log.npz.
        directory: made when missing.
        terrain: for the ground under path and feet.
        robot: RobotModel, for the torque limits and the foot radius.
    """
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    figures = {
        "path": path_figure(log, terrain),
        "base": base_figure(log),
        "feet": feet_figure(log, terrain, robot.foot_radius if robot else 0.0),
        "torques": torque_figure(log, robot.effort_limits if robot else None),
    }
    for name, figure in figures.items():
        figure.savefig(directory / f"{name}.png", dpi=110)
    return [directory / f"{name}.png" for name in figures]


def path_figure(log: Mapping, terrain: Terrain | None = None, *, goal: bool = True) -> Figure:
    """The way of the base from above, with the touch-downs (dots) and the planned footholds (rings), over the terrain.

    ``goal``: whether the robot was on its way to the terrain's goal; else this is not shown.
    """
    figure = Figure(figsize=(10, 5.5), layout="constrained")
    axes = figure.subplots()
    path = np.asarray(log["p_WB"])
    if terrain is not None:
        view = _view_of_path(path[:, :2], terrain, goal)
        draw_terrain(axes, terrain, view=view, ends=False)
        draw_start(axes, terrain)
        if goal:
            draw_goal(axes, terrain)
        # No more paper than the terrain needs.
        width, height = view[1] - view[0], view[3] - view[2]
        scale = min(9.2 / width, 5.5 / height)
        figure.set_size_inches(max(scale * width + 0.8, 5.0), max(scale * height + 0.7, 2.5))
    if "foothold_position" in log:
        for leg in Leg:
            planned = np.asarray(log["foothold_position"])[np.asarray(log["foothold_leg"]) == leg]
            axes.plot(*planned[:, :2].T, "o", markersize=8, fillstyle="none", color=LEG_COLORS[leg], zorder=5)
    for leg in Leg:
        touchdowns = touchdown_positions(log, leg)
        axes.plot(*touchdowns[:, :2].T, ".", color=LEG_COLORS[leg], label=f"{leg.name} foot", zorder=6)
    axes.plot(path[:, 0], path[:, 1], color="black", linewidth=1.8, label="base", zorder=7)
    if "reference_p_WB" in log:
        axes.plot(*np.asarray(log["reference_p_WB"])[:, :2].T, **_REFERENCE_STYLE, label="base, planned", zorder=7)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(loc="upper left", fontsize=8, framealpha=0.9)
    return figure


def _view_of_path(path: np.ndarray, terrain: Terrain, goal: bool) -> tuple[float, float, float, float]:
    """x_min, x_max, y_min, y_max [m]: a path (n, 2) with a margin, and what matters of the terrain."""
    seen = np.vstack((path[np.isfinite(path).all(axis=1)], terrain.start[:2]))
    low, high = seen.min(axis=0) - 0.8, seen.max(axis=0) + 0.8
    if goal:
        x_min, x_max, y_min, y_max = view_of(terrain, margin=1.0)
        low, high = np.minimum(low, (x_min, y_min)), np.maximum(high, (x_max, y_max))
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def base_figure(log: Mapping) -> Figure:
    """Position and attitude of the base over time, with the reference."""
    figure = Figure(figsize=(10, 7), layout="constrained")
    rows = figure.subplots(4, 1, sharex=True)
    time, position = np.asarray(log["time"]), np.asarray(log["p_WB"])
    reference = np.asarray(log["reference_p_WB"]) if "reference_p_WB" in log else np.full_like(position, np.nan)
    for axes, axis, name in zip(rows, range(3), "xyz", strict=False):
        axes.plot(time, position[:, axis], color="black", label="measured")
        axes.plot(time, reference[:, axis], **_REFERENCE_STYLE, label="planned")
        axes.set_ylabel(f"{name} [m]")
    rows[0].legend(loc="upper left", fontsize=8)
    for axis, name in enumerate(("roll", "pitch", "yaw")):
        rows[3].plot(time, np.rad2deg(np.asarray(log["rpy_WB"])[:, axis]), label=name)
    rows[3].set_ylabel("attitude [deg]")
    rows[3].legend(loc="upper left", fontsize=8, ncols=3)
    _finish(rows)
    return figure


def feet_figure(log: Mapping, terrain: Terrain | None = None, foot_radius: float = 0.0) -> Figure:
    """Heights of the soles with the ground under them, vertical forces, and the gait as bars (a bar: in contact)."""
    figure = Figure(figsize=(10, 9), layout="constrained")
    rows = figure.subplots(6, 1, sharex=True, height_ratios=[1, 1, 1, 1, 1.2, 0.8])
    time, feet = np.asarray(log["time"]), np.asarray(log["foot_positions"])
    truth = GroundTruth(terrain) if terrain is not None else None
    for leg in Leg:
        axes, color = rows[leg], LEG_COLORS[leg]
        axes.plot(time, feet[:, leg, 2] - foot_radius, color=color)
        if truth is not None:
            known = np.isfinite(feet[:, leg, :2]).all(axis=1)  # not where a simulation has broken down
            ground = truth.nearest_walkable_height(*feet[known, leg, :2].T)
            axes.plot(time[known], ground, color="0.5", linewidth=0.9)
        axes.set_ylabel(f"{leg.name} z [m]")
        if "contact_forces" in log:
            rows[4].plot(time, np.asarray(log["contact_forces"])[:, leg, 2], color=color, linewidth=0.8, label=leg.name)
    rows[4].set_ylabel("force z [N]")
    if "contact_forces" in log:
        rows[4].legend(loc="upper left", fontsize=8, ncols=4)
    if "contacts" in log:
        draw_gait(rows[5], time, np.asarray(log["contacts"]))
    _finish(rows)
    return figure


def draw_gait(axes: Axes, time: np.ndarray, contacts: np.ndarray):
    """Draws one bar per leg over the times in which its foot touches the ground; ``contacts`` is bool (n, 4)."""
    for leg in Leg:
        down = np.concatenate(([False], contacts[:, leg].astype(bool), [False]))
        changes = np.flatnonzero(np.diff(down.astype(int)))
        starts, ends = changes[::2], np.minimum(changes[1::2], len(time) - 1)
        spans = [(time[a], max(time[b] - time[a], 1e-3)) for a, b in zip(starts, ends, strict=True)]
        axes.broken_barh(spans, (leg - 0.4, 0.8), facecolors=LEG_COLORS[leg])
    axes.set_yticks(list(Leg), [leg.name for leg in Leg])
    axes.invert_yaxis()
    axes.set_ylabel("contact")


def torque_figure(log: Mapping, limits: np.ndarray | None = None) -> Figure:
    """Joint torques by kind of joint with ``limits`` [N m] (12,)."""
    figure = Figure(figsize=(10, 6), layout="constrained")
    rows = figure.subplots(JOINTS_PER_LEG, 1, sharex=True)
    time, torques = np.asarray(log["time"]), np.asarray(log["joint_torques"])
    for k, axes in enumerate(rows):
        for leg in Leg:
            axes.plot(time, torques[:, JOINTS_PER_LEG * leg + k], color=LEG_COLORS[leg], linewidth=0.8, label=leg.name)
        if limits is not None:
            limit = np.max(np.asarray(limits)[k::JOINTS_PER_LEG])
            for sign in (-1, 1):
                axes.axhline(sign * limit, color=BASE_REFERENCE_COLOR, linestyle="--", linewidth=0.9)
        axes.set_ylabel(f"{JOINT_KINDS[k]} [N m]")
    rows[0].legend(loc="upper left", fontsize=8, ncols=4)
    _finish(rows)
    return figure


def touchdown_positions(log: Mapping, leg: Leg) -> np.ndarray:
    """Returns where the foot of ``leg`` came down [m], (n, 3), from contacts that last at least three samples."""
    contacts = np.asarray(log["contacts"])[:, leg].astype(bool)
    feet = np.asarray(log["foot_positions"])[:, leg]
    began = np.flatnonzero(np.diff(np.concatenate(([0], contacts.astype(int)))) == 1)
    lasting = [i for i in began if contacts[i : i + 3].all() and i + 2 < len(contacts)]
    return feet[[i + 2 for i in lasting]].reshape(-1, 3)


def _finish(rows):
    for axes in rows:
        axes.grid(alpha=0.3)
        axes.margins(x=0.01)
    rows[-1].set_xlabel("time [s]")
