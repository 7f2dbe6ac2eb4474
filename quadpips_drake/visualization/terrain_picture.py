"""A terrain seen from above: heights as colours with shading, edges of its elements, start and goal."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrow

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.terrain import GOAL_TOLERANCE, Terrain
from quadpips_drake.terrain.truth import GroundTruth

HEIGHT_COLORS = LinearSegmentedColormap.from_list("ground", ["#5d7a63", "#c9c4a0", "#e8dcc0", "#c98f5a", "#8c4a2f"])
NON_PASSABLE_COLOR = np.array([0.22, 0.24, 0.29])
VOID_COLOR = np.array([1.0, 1.0, 1.0])
START_COLOR, GOAL_COLOR = "#1f5fbf", "#c2185b"
_LIGHT = np.array([-0.4, 0.5, 0.77])
_MIN_SPAN = 0.2


def view_of(terrain: Terrain, margin: float = 2.0) -> tuple[float, float, float, float]:
    """Returns x_min, x_max, y_min, y_max [m] of what matters: start and goal with ``margin`` [m], within the terrain."""
    low, high = terrain.bounds()
    ends = np.array([terrain.start[:2], terrain.goal])
    low = np.maximum(low[:2] - 0.1, ends.min(axis=0) - margin)
    high = np.minimum(high[:2] + 0.1, ends.max(axis=0) + margin)
    # A start or goal off the terrain shall still be seen.
    low, high = np.minimum(low, ends.min(axis=0) - 0.3), np.maximum(high, ends.max(axis=0) + 0.3)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def draw_terrain(axes: Axes, terrain: Terrain, *, view=None, resolution: float = 0.01, ends: bool = True) -> ScalarMappable:
    """Draws ``terrain`` from above into ``axes``.

    Args:
        axes: Matplotlib axes; x and y in W [m].
        terrain: what to draw.
        view: x_min, x_max, y_min, y_max [m]; by default what matters of it.
        resolution: size of a pixel [m].
        ends: whether to draw start and goal.

    Returns: the scale of the heights, for a colour bar.
    """
    x_min, x_max, y_min, y_max = view_of(terrain) if view is None else view
    resolution = max(resolution, max(x_max - x_min, y_max - y_min) / 1500)
    x, y = np.meshgrid(np.arange(x_min, x_max, resolution), np.arange(y_min, y_max, resolution))
    image, scale = _height_image(terrain, x, y)
    axes.imshow(image, origin="lower", extent=(x_min, x_max, y_min, y_max), interpolation="nearest", zorder=0)
    if ends:
        draw_start(axes, terrain)
        draw_goal(axes, terrain)
    axes.set_aspect("equal")
    axes.set_xlim(x_min, x_max)
    axes.set_ylim(y_min, y_max)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    return scale


def draw_start(axes: Axes, terrain: Terrain) -> None:
    """Marks the start: an arrow along its yaw."""
    x, y, yaw = terrain.start
    axes.plot(x, y, "o", color=START_COLOR, markersize=6, markeredgecolor="white", zorder=9, label="start")
    arrow = FancyArrow(
        x, y, 0.45 * np.cos(yaw), 0.45 * np.sin(yaw), width=0.035, length_includes_head=True,
        facecolor=START_COLOR, edgecolor="white", linewidth=0.5, zorder=8,
    )  # fmt: skip
    axes.add_patch(arrow)


def draw_goal(axes: Axes, terrain: Terrain) -> None:
    """Marks the goal with a circle of the distance that counts as reached."""
    angle = np.linspace(0, 2 * np.pi, 60)
    circle = terrain.goal + GOAL_TOLERANCE * np.column_stack((np.cos(angle), np.sin(angle)))
    axes.plot(*circle.T, color=GOAL_COLOR, linewidth=1.6, zorder=8)
    axes.plot(*terrain.goal, "*", color=GOAL_COLOR, markersize=12, markeredgecolor="white", zorder=9, label="goal")


def save_terrain_picture(terrain: Terrain, path: str | Path):
    """Writes the view from above as a picture (PNG, SVG or PDF by the name's ending). Raises UserInputError."""
    x_min, x_max, y_min, y_max = view_of(terrain)
    width = 9.0
    height = np.clip((width - 1.6) * (y_max - y_min) / (x_max - x_min) + 1.1, 2.5, 12.0)
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots()
    scale = draw_terrain(axes, terrain)
    axes.set_title(f"{terrain.name}: {len(terrain.elements)} elements, friction {terrain.friction:g}")
    axes.legend(loc="upper left", framealpha=0.9)
    figure.colorbar(scale, cax=axes.inset_axes([1.02, 0.0, 0.025, 1.0]), label="height [m]")
    try:
        figure.savefig(path, dpi=130)
    except ValueError:
        raise UserInputError(f"cannot write '{path}': its name must end in .png, .svg or .pdf") from None
    except OSError as error:
        raise UserInputError(f"cannot write '{path}': {error.strerror or error}") from None


def _height_image(terrain: Terrain, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, ScalarMappable]:
    """Colours (rows, columns, 3) by height, shaded by slope, with dark borders where height or element jump."""
    truth = GroundTruth(terrain)
    heights, elements, normals = truth.height(x, y), truth.element(x, y), truth.normal(x, y)
    walkable = np.array([element.is_walkable for element in terrain.elements] + [False])[elements]
    low, high = (heights[walkable].min(), heights[walkable].max()) if walkable.any() else (0.0, 0.0)
    middle, span = 0.5 * (low + high), max(high - low, _MIN_SPAN)
    scale = ScalarMappable(Normalize(middle - 0.5 * span, middle + 0.5 * span), HEIGHT_COLORS)
    image = scale.to_rgba(np.nan_to_num(heights))[..., :3]
    image[(elements >= 0) & ~walkable] = NON_PASSABLE_COLOR
    light = _LIGHT / np.linalg.norm(_LIGHT)
    shade = np.nan_to_num(normals @ light, nan=light[2]) / light[2]
    image *= np.clip(0.45 + 0.55 * shade, 0.4, 1.15)[..., None]
    image[elements < 0] = VOID_COLOR
    filled = np.where(np.isnan(heights), -1e3, heights)
    border = np.zeros(x.shape, bool)
    border[:, 1:] |= (elements[:, 1:] != elements[:, :-1]) | (np.abs(np.diff(filled, axis=1)) > 0.02)
    border[1:, :] |= (elements[1:, :] != elements[:-1, :]) | (np.abs(np.diff(filled, axis=0)) > 0.02)
    image[border] *= 0.55
    return np.clip(image, 0, 1), scale
