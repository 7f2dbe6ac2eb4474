"""The courses of a study from above: where feet may come down, and where they did."""

from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.planner.costmap_visualizer_system import costmap_colors
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmapConfig, exact_costmap
from quadpips_drake.benchmark.motion_models.crossings import Crossing
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.legs import Leg
from quadpips_drake.visualization.colors import LEG_COLORS

_HALF_WIDTH = 0.55
"""How far to both sides of the way a picture reaches [m] ..."""
_MARGIN = 0.8
"""... and beyond start and goal [m]."""
_EDGE = 0.2
"""The map reaches this much further, so that its own edge, which counts as unsafe, is out of the picture [m]."""


def shown_crossings(results: dict, crossings: list[Crossing]) -> list[Crossing]:
    """Of each robot and terrain the first crossing whose touch-downs are known; those of learned models come first."""
    chosen: dict[tuple[str, str], Crossing] = {}
    for crossing in sorted(crossings, key=lambda crossing: crossing.model != "learned"):
        if results.get(crossing.key, {}).get("landings"):
            chosen.setdefault((crossing.terrain, crossing.robot), crossing)
    return [chosen[key] for key in sorted(chosen)]


def save_course_picture(results: dict, crossings: list[Crossing], path: Path) -> bool:
    """Draws the foot costmap of the true terrain and the touch-downs of ``shown_crossings``, one below the other; PNG.

    Returns: whether there was anything to draw.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shown = shown_crossings(results, crossings)
    if not shown:
        return False
    figure = Figure(figsize=(12, 1.0 + 2.1 * len(shown)), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, crossing in zip(figure.subplots(len(shown), squeeze=False)[:, 0], shown, strict=True):
        _draw(axes, crossing, results[crossing.key])
    axes.set_xlabel("x [m]")
    figure.axes[0].legend(loc="upper left", ncols=4, fontsize=8)
    figure.savefig(path, dpi=90)
    return True


def _draw(axes, crossing: Crossing, result: dict) -> None:
    """One course and one crossing of it."""
    terrain = load_terrain(crossing.terrain, seed=crossing.seed)
    start, goal = np.array(terrain.start[:2]), np.array(terrain.goal)
    middle, reach = 0.5 * (start + goal), 0.5 * float(np.hypot(*(goal - start))) + _MARGIN
    config = FootCostmapConfig(exact_reach=min(reach + _EDGE, 10.0))
    costmap = exact_costmap(GroundTruth(terrain), 0.0, middle, config)
    ends = costmap.corner + costmap.cell * np.array(costmap.distance.shape)
    colors = costmap_colors(costmap.distance).transpose(1, 0, 2)
    axes.imshow(colors, origin="lower", extent=(costmap.corner[0], ends[0], costmap.corner[1], ends[1]), alpha=0.6)
    landed = np.array(result["landings"])
    for leg in Leg:
        x, y = landed[landed[:, 0] == leg, 1:].T
        axes.plot(x, y, "o", markersize=5, color=LEG_COLORS[leg], markeredgecolor="black", label=leg.name)
    axes.plot(*goal, "*", markersize=12, color="black")
    axes.set(xlim=(middle[0] - reach, middle[0] + reach), ylabel="y [m]")
    axes.set_ylim(middle[1] - _HALF_WIDTH, middle[1] + _HALF_WIDTH)
    told = f"{crossing.terrain}, {crossing.robot}, {crossing.model}"
    horizon = f", N = {crossing.horizon}" if crossing.horizon else ""
    axes.set_title(f"{told}{horizon}, {crossing.map}, seed {crossing.seed}: {result['reason']}", fontsize=10)
