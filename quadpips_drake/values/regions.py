"""Planar convex regions and the heights of the ground: what perception hands to planning, and an elevation map."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue


@dataclass(frozen=True, eq=False)
class PlanarRegion(ImmutableValue):
    """A convex planar patch of ground that may carry a foot.

    Frame R lies in the plane, its z axis is the upward normal, its origin is inside the inset polygon. The origin is also
    the foothold candidate of the region (the point of the ground under the foot sphere).
    """

    id: int
    """Unique in its set. A region keeps its id from frame to frame as long as it is the same piece of ground; other ground
    never gets it again."""
    X_WR: np.ndarray
    """Pose of the region frame R in the world, homogeneous matrix (4, 4)."""
    boundary: np.ndarray
    """Convex hull [m], shape (n, 2), in the xy plane of R, counter-clockwise."""
    inset: np.ndarray
    """Convex polygon [m], shape (m, 2), counter-clockwise: the boundary shrunk by foot radius and margin."""
    label: int = 0
    """A steppability label (see values.steppability): 0 is unknown."""

    @property
    def center(self) -> np.ndarray:
        """Origin of R in the world [m], shape (3,)."""
        return self.X_WR[:3, 3]

    @property
    def normal(self) -> np.ndarray:
        """Upward unit normal in the world, shape (3,)."""
        return self.X_WR[:3, 2]


@dataclass(frozen=True, eq=False)
class RegionSet(ImmutableValue):
    """All regions known at one time; frame W."""

    stamp: float
    """Time of the newest image behind it [s]."""
    regions: tuple = ()
    """Tuple of PlanarRegion."""

    @staticmethod
    def empty() -> "RegionSet":
        """Nothing was seen yet."""
        return RegionSet(-np.inf)


@dataclass(frozen=True, eq=False)
class GroundHeights(ImmutableValue):
    """Heights of the ground on a grid of square cells along x and y of W; frame W."""

    stamp: float
    """Of the newest measurement in it [s]."""
    corner: np.ndarray
    """x, y of the corner of cell (0, 0) with the least x and y [m], (2,)."""
    cell: float
    """Side of a cell [m]."""
    height: np.ndarray
    """z of the highest surface in each cell [m], float32 (n, m), first index along x; NaN where unknown."""

    def at(self, x, y) -> np.ndarray:
        """Heights [m] of the cells with the points x, y (n,) [m], (n,); NaN where unknown."""
        i = np.floor((x - self.corner[0]) / self.cell).astype(int)
        j = np.floor((y - self.corner[1]) / self.cell).astype(int)
        inside = (i >= 0) & (i < self.height.shape[0]) & (j >= 0) & (j < self.height.shape[1])
        found = np.full(len(i), np.nan)
        found[inside] = self.height[i[inside], j[inside]]
        return found

    def points_around(self, xy: np.ndarray, radius: float) -> np.ndarray:
        """Known points in the middles of cells within ``radius`` of ``xy`` (2,), in W [m], (n, 3)."""
        low = np.clip(np.floor((xy - radius - self.corner) / self.cell).astype(int), 0, self.height.shape)
        high = np.clip(np.ceil((xy + radius - self.corner) / self.cell).astype(int), 0, self.height.shape)
        i, j = np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij")
        points = np.column_stack(
            (self.corner + self.cell * (np.column_stack((i.ravel(), j.ravel())) + 0.5), self.height[i, j].ravel())
        )
        return points[np.isfinite(points[:, 2]) & (np.hypot(*(points[:, :2] - xy).T) <= radius)]

    @staticmethod
    def empty() -> "GroundHeights":
        """Nothing is known."""
        return GroundHeights(-np.inf, np.zeros(2), 0.01, np.zeros((0, 0), np.float32))


@dataclass(frozen=True, eq=False)
class ElevationMap(ImmutableValue):
    """One height and its variance per square cell in a window that travels with the robot in whole cells; frame W.

    Cell (i, j) covers x in [cell (first_cell[0] + i), + cell), y likewise with j.
    """

    stamp: float
    """Time of the newest depth image in it [s]."""
    first_cell: np.ndarray
    """World indices of cell (0, 0), int64 (2,)."""
    cell: float
    """Side of a cell [m]."""
    height: np.ndarray
    """z of the surface [m], float32 (n, n); NaN where unknown."""
    variance: np.ndarray
    """Of the height [m^2], float32 (n, n); NaN where unknown."""
    X_WB: np.ndarray
    """Pose of the base at that time, (4, 4)."""
    cleaned: float = -np.inf
    """When cells that the camera sees through were last removed [s]."""

    @property
    def corner(self) -> np.ndarray:
        """x, y of the corner of cell (0, 0) with the least x and y [m], (2,)."""
        return self.first_cell * self.cell

    @staticmethod
    def empty(cells: int = 0, cell: float = 0.03) -> "ElevationMap":
        """Returns a window of ``cells`` by ``cells`` in which nothing is known."""
        unknown = np.full((cells, cells), np.nan, np.float32)
        return ElevationMap(-np.inf, np.full(2, -cells // 2, np.int64), cell, unknown, unknown.copy(), np.eye(4))


@dataclass(frozen=True, eq=False)
class SignedDistance(ImmutableValue):
    """Distance from the ground around the robot on a grid of points; frame W. Between them it is trilinear
    (``math.trilinear``)."""

    stamp: float
    """Of the map that it was made of [s]."""
    origin: np.ndarray
    """Where point (0, 0, 0) lies [m], (3,)."""
    step: float
    """Between neighbouring points, along each axis [m]."""
    distance: np.ndarray
    """[m], negative in the ground, float32 (n, m, k), indices along x, y, z."""

    @staticmethod
    def empty() -> "SignedDistance":
        """Nothing is known."""
        return SignedDistance(-np.inf, np.zeros(3), 1.0, np.zeros((0, 0, 0), np.float32))
