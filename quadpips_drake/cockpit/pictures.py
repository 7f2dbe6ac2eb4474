"""Small pictures as PNG: what the camera measures, how it was labelled, the terrain from above."""

import io

import cv2
import numpy as np
from matplotlib.figure import Figure

from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import REGION_COLORS
from quadpips_drake.visualization.terrain_picture import draw_terrain

WIDTH = 320
"""Of camera pictures [pixels]."""
_FAR = 4.0
"""Depth that is drawn darkest [m]."""
_NOTHING = (60, 60, 60)
"""Colour of pixels without depth."""
_DPI = 100
_SHADE = (0.45, 1.0)
"""Brightness of labels far away and near."""


def depth_png(depth: np.ndarray) -> bytes:
    """``depth`` [m], (height, width), NaN, 0 or inf where there is none, as colours: near ones light."""
    depth, known = _smaller(depth)
    colors = cv2.applyColorMap(np.uint8(255 * _nearness(depth, known)), cv2.COLORMAP_VIRIDIS)
    colors[~known] = _NOTHING
    return _png(colors)


def label_png(labels: np.ndarray, depth: np.ndarray) -> bytes:
    """Steppability ``labels`` (height, width) as colours, darker far away by ``depth`` [m]; grey where unknown."""
    small, known = _smaller(depth)
    labels = labels[:: _step(labels), :: _step(labels)]
    table = np.array([REGION_COLORS[Steppability(value)][::-1] for value in range(len(REGION_COLORS))])
    table[Steppability.UNKNOWN] = 0.55
    shade = _SHADE[0] + (_SHADE[1] - _SHADE[0]) * _nearness(small, known)
    colors = np.uint8(255 * table[labels] * shade[..., None])
    colors[~known] = _NOTHING
    return _png(colors)


def map_png(terrain: Terrain, view: tuple[float, float, float, float], width: int = 600) -> bytes:
    """``terrain`` from above; ``view``: x_min, x_max, y_min, y_max [m], which fill the picture, ``width`` pixels wide."""
    x_min, x_max, y_min, y_max = view
    height = width * (y_max - y_min) / (x_max - x_min)
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    draw_terrain(axes, terrain, view=view, resolution=(x_max - x_min) / width, ends=False)
    axes.set_axis_off()
    axes.set_aspect("auto")
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=_DPI)
    return data.getvalue()


def _step(image: np.ndarray) -> int:
    return max(1, image.shape[1] // WIDTH)


def _smaller(depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every so manieth pixel, and where there is depth."""
    depth = depth[:: _step(depth), :: _step(depth)]
    return depth, np.isfinite(depth) & (depth > 0.0)


def _nearness(depth: np.ndarray, known: np.ndarray) -> np.ndarray:
    """1 at the camera, 0 from _FAR on, and where nothing is known."""
    return np.where(known, 1.0 - np.clip(np.where(known, depth, _FAR) / _FAR, 0.0, 1.0), 0.0)


def _png(colors: np.ndarray) -> bytes:
    return cv2.imencode(".png", colors)[1].tobytes()
