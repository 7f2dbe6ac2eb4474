"""The last moments of a trial on one time axis: what was asked (dashed) and what happened."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.trials.explaining.first_events import Event
from quadpips_drake.trials.explaining.last_moments import LastMoments
from quadpips_drake.values.legs import JOINTS_PER_LEG, Leg
from quadpips_drake.visualization.colors import BASE_REFERENCE_COLOR, LEG_COLORS
from quadpips_drake.visualization.plots import JOINT_KINDS

_ASKED = {"color": BASE_REFERENCE_COLOR, "linestyle": "--", "linewidth": 1.3}
_STYLES = ("-", "--", ":")
_NUMBERED = 12
"""So many events have a line and a number; more would hide the curves."""
_EVENT_COLOR, _FIRST_COLOR = "0.35", (0.85, 0.10, 0.15)


def failure_figure(moments: LastMoments, events: list[Event], first: int | None = None) -> Figure:
    """Returns base, feet, contacts and torques over time, ``events`` at the top, the ``first`` of the chain in red."""
    figure = Figure(figsize=(12.0, 15.0), layout="constrained")
    heights = [0.5, 1.1, 1.1, 1.1, 1.0, *[1.0] * len(Leg), 1.3, 1.5]
    rows = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    _draw_events(rows, events, first)
    names = ("height z [m]", "roll [deg]", "pitch [deg]", "yaw [deg]")
    for axes, column, name in zip(rows[1:5], (2, 3, 4, 5), names, strict=True):
        scale = 1.0 if column == 2 else 180.0 / np.pi
        asked, measured = moments.asked_base[:, column], moments.base[:, column]
        if column == 5:
            asked, measured = _unwrapped_to(asked, measured)
        axes.plot(moments.time, scale * measured, color="black", linewidth=1.3, label="measured")
        axes.plot(moments.time, scale * asked, **_ASKED, label="reference (none: nothing to follow)")
        axes.set_ylabel(name)
        _widen(axes, 0.06 if column == 2 else 8.0)
    rows[1].legend(loc="best", fontsize=8, ncols=2)
    for leg in Leg:
        _draw_foot(rows[5 + leg], moments, leg)
    _draw_contacts(rows[-2], moments)
    _draw_torques(rows[-1], moments)
    for axes in rows[1:]:
        axes.grid(alpha=0.3)
    figure.align_ylabels(rows)
    rows[-1].set_xlabel("time t [s]")
    rows[-1].set_xlim(moments.time[0], max(moments.time[-1], moments.time[0] + 0.01))
    return figure


def _draw_events(rows, events: list[Event], first: int | None) -> None:
    """A tick for each event; from the first of the chain, which is red, on, _NUMBERED of them have a line and a number."""
    axes, level, begin = rows[0], 0, first or 0
    axes.plot([event.time for event in events], np.full(len(events), 0.04), "|", color=_EVENT_COLOR, markersize=5)
    for k, event in list(enumerate(events))[begin : begin + _NUMBERED]:
        color = _FIRST_COLOR if k == first else _EVENT_COLOR
        for row in rows:
            row.axvline(event.time, color=color, linewidth=1.6 if k == first else 0.7, alpha=0.8, zorder=1)
        level = (level + 1) % 3
        axes.text(
            event.time, 0.2 + 0.3 * level, f"{k + 1}", color="white", fontsize=8, ha="center", va="center",
            bbox={"boxstyle": "round,pad=0.2", "facecolor": color, "edgecolor": "none"},
        )  # fmt: skip
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.set_ylabel("events", rotation=0, ha="right", va="center")


def _widen(axes: Axes, least: float) -> None:
    """Shows a span of ``least`` at least, so that what hardly changes looks so."""
    low, high = axes.get_ylim()
    more = max(0.0, 0.5 * (least - (high - low)))
    axes.set_ylim(low - more, high + more)


def _draw_foot(axes: Axes, moments: LastMoments, leg: Leg) -> None:
    """Height of the sole, the true ground under it, and the swing that was asked."""
    time, sole = moments.time, moments.feet[:, leg, 2] - moments.foot_radius
    asked = moments.asked_feet[:, leg, 2] - moments.foot_radius
    axes.fill_between(
        time, 0.0, 1.0, where=moments.contacts[:, leg], transform=axes.get_xaxis_transform(),
        color=LEG_COLORS[leg], alpha=0.12, linewidth=0, label="touches",
    )  # fmt: skip
    axes.plot(time, moments.ground[:, leg], color="0.45", linewidth=1.2, label="true ground below it")
    axes.plot(time, sole, color=LEG_COLORS[leg], linewidth=1.6, label="measured")
    axes.plot(time, asked, **_ASKED, label="asked (swings)")
    axes.set_ylabel(f"{leg.name} sole\nz [m]")
    _widen(axes, 0.08)
    if leg == Leg.LF:
        axes.legend(loc="upper left", fontsize=8, ncols=4)


def _draw_contacts(axes: Axes, moments: LastMoments) -> None:
    """Three bars per leg: when it was to stand (frame), when its foot (filled) and when its other links touched (black)."""
    of_leg = np.array([[link.startswith(leg.name) for link in LINK_NAMES] for leg in Leg])
    links = (moments.touches[:, None] & of_leg).any(axis=2)
    step = float(np.median(np.diff(moments.time))) if len(moments.time) > 1 else 0.01
    for leg in Leg:
        for flags, low, style in (
            (moments.asked_contacts[:, leg], leg - 0.42, {"facecolor": "none", "edgecolor": BASE_REFERENCE_COLOR}),
            (moments.contacts[:, leg], leg - 0.12, {"facecolor": LEG_COLORS[leg], "edgecolor": "none"}),
            (links[:, leg], leg + 0.18, {"facecolor": "black", "edgecolor": "none"}),
        ):
            changes = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
            spans = [(moments.time[a], (b - a) * step) for a, b in zip(changes[::2], changes[1::2], strict=True)]
            axes.broken_barh(spans, (low, 0.27), **style)
    axes.set_yticks(list(Leg), [leg.name for leg in Leg])
    axes.set_ylim(len(Leg) - 0.45, -0.55)
    axes.set_ylabel("contact: asked\n(frame), foot,\nthigh, shank (black)")


def _draw_torques(axes: Axes, moments: LastMoments) -> None:
    """All joint torques as parts of their limits."""
    for leg in Leg:
        for k, style in enumerate(_STYLES):
            joint = JOINTS_PER_LEG * leg + k
            part = moments.torques[:, joint] / moments.torque_limits[joint]
            axes.plot(moments.time, part, style, color=LEG_COLORS[leg], linewidth=1.0, label=f"{leg.name} {JOINT_KINDS[k]}")
    for sign in (-1.0, 1.0):
        axes.axhline(sign, **_ASKED)
    axes.set_ylim(-1.15, 1.15)
    axes.set_ylabel("torque /\nlimit [1]")
    axes.legend(loc="lower left", fontsize=7, ncols=12, columnspacing=0.8, handlelength=1.4)


def _unwrapped_to(asked: np.ndarray, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``measured`` angles without jumps, ``asked`` ones on the same turn [rad]."""
    measured = np.unwrap(measured)
    return asked - 2.0 * np.pi * np.round((asked - measured) / (2.0 * np.pi)), measured
