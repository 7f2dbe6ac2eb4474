"""Elevation maps without a camera: of analytic scenes."""

import numpy as np

from quadpips_drake.values.regions import ElevationMap
from tests.perception.scenes import Scene


def ideal_map(scene: Scene, *, cell=0.03, half_extent=1.5, center=(0.0, 0.0), highest=False) -> ElevationMap:
    """The heights of ``scene`` in the middles of the cells, or the ``highest`` of 7 x 7 points each; nothing is unknown."""
    cells = 2 * round(half_extent / cell)
    first_cell = np.floor(np.asarray(center) / cell).astype(np.int64) - cells // 2
    places = np.linspace(0.02, 0.98, 7) if highest else np.array([0.5])
    x, y = (cell * (first + np.arange(cells)[:, None] + places).ravel() for first in first_cell)
    height = scene.height(*np.meshgrid(x, y, indexing="ij")).reshape(cells, len(places), cells, len(places)).max(axis=(1, 3))
    X_WB = np.eye(4)
    X_WB[:2, 3] = center
    return ElevationMap(0.0, first_cell, cell, height.astype(np.float32), np.full(height.shape, 1e-4, np.float32), X_WB)


def turned_height(function, angle):
    """``function(x, y)`` turned by ``angle`` [rad] about the origin, as the ``height`` of a scene."""

    class Turned(Scene):
        def height(self, x, y):
            return function(np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x)

    return Turned([])
