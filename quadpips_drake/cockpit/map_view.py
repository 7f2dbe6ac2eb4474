"""The map: which part of the world it shows, and its picture, drawn anew when that has to be another one."""

from collections.abc import Sequence

import numpy as np

from quadpips_drake.cockpit.pictures import map_png
from quadpips_drake.terrain.terrain import Terrain

_MARGIN = 1.2
"""Around what the map has to show, when it is drawn [m]."""
_NEAR = 0.5
"""What comes this close to the border [m] needs another map."""
_LEAST = 4.5
"""Least side [m]."""


class MapView:
    """A square of the world."""

    def __init__(self):
        self.view = (0.0, 0.0, 0.0, 0.0)
        """x_min, x_max, y_min, y_max [m]."""
        self.png = b""
        self._elements = 0

    def show(self, terrain: Terrain, points: Sequence) -> bool:
        """Makes sure that ``points``, each x, y [m], are on it, and all of ``terrain``; returns whether it is a new one."""
        points = np.array([point[:2] for point in points], dtype=float)
        x_min, x_max, y_min, y_max = self.view
        low, high = np.array([x_min, y_min]) + _NEAR, np.array([x_max, y_max]) - _NEAR
        if len(terrain.elements) == self._elements and (points >= low).all() and (points <= high).all():
            return False
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        half = max(0.5 * _LEAST, 0.5 * float(np.ptp(points, axis=0).max()) + _MARGIN)
        self.view = tuple(float(v) for v in (middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half))
        self.png, self._elements = map_png(terrain, self.view), len(terrain.elements)
        return True
