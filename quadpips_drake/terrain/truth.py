"""Exact answers about the terrain: height, normal, element and distance to an edge at any x, y."""

from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from quadpips_drake.terrain.raycast import ElementArrays, cast_down
from quadpips_drake.terrain.surfaces import PatchIndex, visible_patches
from quadpips_drake.terrain.terrain import Terrain


class GroundTruth:
    """Exact queries of a terrain from straight above; of several surfaces at x, y the highest counts.

    All queries take x and y [m] in W as scalars or arrays that broadcast, and return arrays of that shape (a NumPy scalar
    for scalars). With ``walkable_only`` elements that no foot shall use (a pit floor, say) are left out.
    """

    def __init__(self, terrain: Terrain):
        self.terrain = terrain
        self._surfaces = _surfaces.get(terrain) or _surfaces.setdefault(terrain, _Surfaces(terrain))

    def height(self, x, y, *, walkable_only: bool = False) -> np.ndarray:
        """Height of the surface [m]; NaN where nothing is."""
        return self._cast(x, y, walkable_only)[0]

    def element(self, x, y, *, walkable_only: bool = False) -> np.ndarray:
        """Index of the element whose surface is on top, -1 where nothing is."""
        return self._cast(x, y, walkable_only)[1]

    def normal(self, x, y, *, walkable_only: bool = False) -> np.ndarray:
        """Upward unit normal of the surface in W, shape (..., 3); NaN where nothing is."""
        return self._cast(x, y, walkable_only)[2]

    def label(self, x, y) -> np.ndarray:
        """Steppability of the element on top, uint8; 0 (unknown) where nothing is."""
        return self._surfaces.labels[self.element(x, y)]

    def distance_to_edge(self, x, y) -> np.ndarray:
        """Distance [m] within the plane of the surface to the nearest edge of its visible flat patch; NaN where nothing is.

        An edge is where the patch ends: at a drop, at a kink, or where something higher stands on it. Flush coplanar
        neighbours with the same label are one patch. Curved surfaces (the side of a cylinder) are no patch: 0.
        """
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        heights = self.height(x, y)
        distance = self._surfaces.index.distance_to_edge(np.column_stack((x.ravel(), y.ravel())), heights.ravel())
        return np.where(np.isnan(heights), np.nan, distance.reshape(x.shape))[()]

    def nearest_walkable_height(self, x, y) -> np.ndarray:
        """Height [m] of the walkable surface at x, y or, where there is none, at the horizontally nearest walkable point.

        This is the level against which "a foot below the terrain elements" is measured over gaps and pits.
        """
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        heights = np.array(self.height(x, y, walkable_only=True)).ravel()
        missing = np.isnan(heights)
        if missing.any():
            points = np.column_stack((x.ravel(), y.ravel()))[missing]
            heights[missing] = self._surfaces.walkable_index.nearest_height(points)
        return heights.reshape(x.shape)[()]

    @property
    def patches(self) -> tuple:
        """The flat visible pieces of the surface (SurfacePatch), of all labels."""
        return self._surfaces.patches

    def _cast(self, x, y, walkable_only: bool):
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        arrays = self._surfaces.walkable if walkable_only else self._surfaces.all
        heights, elements, normals = cast_down(x.ravel(), y.ravel(), arrays)
        return heights.reshape(x.shape)[()], elements.reshape(x.shape)[()], normals.reshape((*x.shape, 3))


class _Surfaces:
    """What has been worked out about a terrain's surfaces so far, for all who ask about it."""

    def __init__(self, terrain: Terrain):
        self._elements = terrain.elements
        self.labels = np.array([element.label for element in terrain.elements] + [0], np.uint8)
        """Of each element, and at last that of nothing."""
        self.all = ElementArrays(terrain)
        self.walkable = ElementArrays(terrain, keep=[element.is_walkable for element in terrain.elements])

    @cached_property
    def patches(self) -> tuple:
        return visible_patches(self._elements)

    @cached_property
    def index(self) -> PatchIndex:
        return PatchIndex(self.patches)

    @cached_property
    def walkable_index(self) -> PatchIndex:
        return PatchIndex(tuple(patch for patch in self.patches if patch.is_walkable))


_surfaces: WeakKeyDictionary[Terrain, _Surfaces] = WeakKeyDictionary()
"""Of terrains in use. A terrain never changes; what is known of it goes with it."""
