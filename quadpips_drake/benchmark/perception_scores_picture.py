"""The picture of an evaluation of perception: where it was right, over the last moment's map and over time."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from quadpips_drake.benchmark.perception_scores import CELL, PerceptionScorer

_COLORS = {
    "not seen": (0.80, 0.80, 0.80),
    "seen, not steppable or out of the cap": (0.93, 0.93, 0.90),
    "steppable and covered": (0.35, 0.72, 0.40),
    "steppable, not covered": (0.98, 0.70, 0.25),
    "false-safe": (0.85, 0.10, 0.10),
    "void": (0.15, 0.15, 0.20),
}


def save_scores_picture(path: str | Path, scorer: PerceptionScorer, title: str, moments: list[dict]) -> None:
    """Writes a PNG: maps of some ``moments`` (of ``scorer.moments``) and curves over time."""
    figure = Figure(figsize=(5.5 * max(len(moments), 2), 9), layout="constrained")
    FigureCanvasAgg(figure)
    top, bottom = figure.subfigures(2, 1, height_ratios=[1.3, 1.0])
    for axis, moment in zip(np.atleast_1d(top.subplots(1, len(moments))), moments, strict=True):
        _show_map(axis, scorer, moment)
    patches = [Patch(color=color, label=name) for name, color in _COLORS.items()]
    top.legend(handles=patches, loc="outside lower center", ncols=3)
    _show_curves(bottom.subplots(1, 3), scorer.rows)
    figure.suptitle(title)
    figure.savefig(path, dpi=70)


def _show_map(axis, scorer: PerceptionScorer, moment: dict) -> None:
    ground = np.isfinite(scorer.map.height)
    picture = np.empty((*ground.shape, 3))
    picture[:] = _COLORS["not seen"]
    picture[moment["seen"]] = _COLORS["seen, not steppable or out of the cap"]
    picture[moment["target"] & moment["covered"]] = _COLORS["steppable and covered"]
    picture[moment["target"] & ~moment["covered"]] = _COLORS["steppable, not covered"]
    picture[~ground] = _COLORS["void"]
    picture[moment["false_safe"]] = _COLORS["false-safe"]
    low = scorer.map.origin
    high = low + CELL * np.array(ground.shape)
    axis.imshow(picture.transpose(1, 0, 2), origin="lower", extent=(low[0], high[0], low[1], high[1]))
    axis.set_title(f"t = {moment['t']:.1f} s")
    axis.set_xlabel("x [m]")
    axis.set_ylabel("y [m]")


def _show_curves(axes, rows: list[dict]) -> None:
    def series(name, scale=1.0):
        return np.array([np.nan if row.get(name) is None else row[name] * scale for row in rows], float)

    def share(part, whole):
        with np.errstate(invalid="ignore", divide="ignore"):
            return 100.0 * series(part) / series(whole)

    t = series("t")
    axes[0].plot(t, share("covered_m2", "target_m2"), label="coverage")
    axes[0].plot(t, share("foot_covered_m2", "target_m2"), label="foot coverage")
    axes[0].plot(t, series("frame_iou", 100.0), label="IoU with the sample before")
    axes[0].set_ylim(0, 105)
    axes[1].plot(t, share("false_safe_m2", "region_m2"), color="tab:red", label="false-safe area")
    for axis in axes[:2]:
        axis.set_ylabel("[%]")
    axes[2].plot(t, series("height_rms_m", 1000.0), label="floor height, RMS [mm]")
    axes[2].plot(t, series("normal_median_deg"), label="floor normal, median [deg]")
    axes[2].plot(t, series("plane_error_median_m", 1000.0), label="region plane, median [mm]")
    for axis in axes:
        axis.set_xlabel("t [s]")
        axis.legend()
        axis.grid(alpha=0.3)
