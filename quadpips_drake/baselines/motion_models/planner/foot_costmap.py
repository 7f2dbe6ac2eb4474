"""Where a foot may come down: safe cells of the ground, their heights, and how far each is from the nearest unsafe one.

Taouil et al., section IV: a cell with a "large height variation compared to [its] neighborhood" is unsafe. Here the heights
of the 3 x 3 cells around it count. What is unknown is unsafe, and so is all that lies outside.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.regions import GroundHeights
from quadpips_drake.values.steppability import Steppability

_FAR = np.float32(1e6)
"""Above and below all ground [m]."""
_NEIGHBOURHOOD = np.ones((3, 3), np.uint8)


@configuration
class FootCostmapConfig:
    """What makes ground unsafe, and how far an exact map reaches."""

    max_height_range: float = ranged(0.04, 0.001, 1.0)
    """Heights in the 3 x 3 cells around a safe one differ by no more than this [m] (the authors' release: 0.10)."""
    exact_cell: float = ranged(0.01, 0.005, 0.1)
    """Side of a cell of the exact map [m]; the sensed one has the cells of the remembered ground."""
    exact_reach: float = ranged(1.6, 0.3, 10.0)
    """How far the exact map reaches from the base along x and y of the world [m]."""


@dataclass(frozen=True, eq=False)
class FootCostmap(ImmutableValue):
    """Where a foot may come down, on a grid of square cells along x and y of W; frame W."""

    stamp: float
    """Of the newest measurement in it [s]."""
    corner: np.ndarray
    """x, y of the corner of cell (0, 0) with the least x and y [m], (2,)."""
    cell: float
    """Side of a cell [m]."""
    height: np.ndarray
    """z of the ground in each cell [m], float32 (n, m), first index along x; NaN where unknown."""
    distance: np.ndarray
    """From the middle of each cell to that of the nearest unsafe one [m], within 2 %, float32 (n, m); 0 where unsafe."""

    @property
    def safe(self) -> np.ndarray:
        """Whether a foot may come down in each cell, bool (n, m)."""
        return self.distance > 0.0

    def at(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Height and distance [m] of the cells with the points ``xy`` (n, 2), (n,) each; NaN and 0 outside."""
        i, j = np.floor((np.asarray(xy) - self.corner) / self.cell).astype(int).T
        inside = (i >= 0) & (i < self.height.shape[0]) & (j >= 0) & (j < self.height.shape[1])
        height, distance = np.full(len(i), np.nan), np.zeros(len(i))
        height[inside], distance[inside] = self.height[i[inside], j[inside]], self.distance[i[inside], j[inside]]
        return height, distance

    @staticmethod
    def empty() -> "FootCostmap":
        """Nothing is known."""
        nothing = np.zeros((0, 0), np.float32)
        return FootCostmap(-np.inf, np.zeros(2), 0.01, nothing, nothing)


def foot_costmap(ground: GroundHeights, config: FootCostmapConfig, forbidden: np.ndarray | None = None) -> FootCostmap:
    """The costmap of known heights.

    Args:
        ground: heights, NaN where unknown.
        config: what is unsafe.
        forbidden: cells on which no foot shall stand whatever their heights are, bool like ``ground.height``.
    """
    height = np.ascontiguousarray(ground.height, np.float32)
    if height.size == 0:
        return FootCostmap.empty()
    known = np.isfinite(height)
    highest = cv2.dilate(np.where(known, height, -_FAR), _NEIGHBOURHOOD)
    lowest = cv2.erode(np.where(known, height, _FAR), _NEIGHBOURHOOD)
    safe = known & (highest - lowest <= np.float32(config.max_height_range))
    if forbidden is not None:
        safe &= ~forbidden
    framed = np.zeros((safe.shape[0] + 2, safe.shape[1] + 2), np.uint8)  # what lies outside is unknown
    framed[1:-1, 1:-1] = safe
    cells = cv2.distanceTransform(framed, cv2.DIST_L2, cv2.DIST_MASK_5)[1:-1, 1:-1]
    distance = np.ascontiguousarray(cells) * np.float32(ground.cell)
    return FootCostmap(ground.stamp, np.array(ground.corner, float), float(ground.cell), height, distance)


def exact_costmap(truth: GroundTruth, stamp: float, center: np.ndarray, config: FootCostmapConfig) -> FootCostmap:
    """The costmap of the true terrain around ``center``, x, y in W [m]; ground that no foot shall use is unsafe there."""
    cell, count = config.exact_cell, 2 * round(config.exact_reach / config.exact_cell)
    first = np.floor(center[:2] / cell) - count // 2
    x, y = (cell * (first[:, None] + np.arange(count) + 0.5))[..., None]
    label = truth.label(x, y.T)
    forbidden = (label != Steppability.STEPPABLE) & (label != Steppability.UNKNOWN)
    ground = GroundHeights(stamp, first * cell, cell, truth.height(x, y.T).astype(np.float32))
    return foot_costmap(ground, config, forbidden)
