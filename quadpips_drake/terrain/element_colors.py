"""The colours in which terrains are drawn: by label, and such that steps and stones stand out from the ground."""

import numpy as np

from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.values.steppability import Steppability

COLORS = {
    Steppability.UNKNOWN: (0.60, 0.60, 0.60, 1.0),
    Steppability.STEPPABLE: (0.70, 0.67, 0.60, 1.0),
    Steppability.PASSABLE: (0.86, 0.62, 0.28, 1.0),
    Steppability.NON_PASSABLE: (0.33, 0.36, 0.42, 1.0),
}
"""Red, green, blue, alpha of the elements by label."""
_HIGH = np.array([0.74, 0.50, 0.34])
"""What the highest ground that can be walked on tends to."""
_STEPS = 6
"""Shades from low to high: many elements of one shade are drawn as one mesh."""
_LEAST_SPAN = 0.3
"""Differences in height below this do not use the whole range of shades [m]."""
_SMALL = 1.0
"""What covers less ground than this is a stone or a step [m^2]..."""
_LIGHTER, _DARKER = 1.18, 1.09
"""... and by so much lighter than the ground, in turn."""


def element_colors(terrain: Terrain) -> list[tuple[float, ...]]:
    """Red, green, blue, alpha of each element: the label's; where one can walk browner with height, stones lighter."""
    bounds = terrain.element_bounds
    tops, areas = bounds[:, 1, 2], (bounds[:, 1, :2] - bounds[:, 0, :2]).prod(axis=1)
    walkable = np.array([element.is_walkable for element in terrain.elements])
    low, high = (tops[walkable].min(), tops[walkable].max()) if walkable.any() else (0.0, 0.0)
    shades = np.round((tops - low) / max(high - low, _LEAST_SPAN) * (_STEPS - 1)) / (_STEPS - 1)
    colors = []
    for index, element in enumerate(terrain.elements):
        color = np.array(COLORS[element.label])
        if element.is_walkable:
            color[:3] += shades[index] * (_HIGH - color[:3])
            if areas[index] < _SMALL:
                color[:3] *= _LIGHTER if index % 2 else _DARKER
        colors.append(tuple(np.clip(color, 0.0, 1.0).round(3).tolist()))
    return colors
