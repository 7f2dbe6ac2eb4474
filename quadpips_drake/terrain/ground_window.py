"""The part of a large terrain that takes part in collisions: what lies near the robot.

What Drake spends on collisions grows with the square of the number of shapes that can be touched, so of a large terrain only
those in a square around the robot can be; the square moves with it. Nothing is approximated: what lies further away than the
robot reaches is not touched anyway.
"""

import numpy as np
import shapely
from pydrake.geometry import GeometryId, ProximityProperties, Role, SceneGraph, SourceId

from quadpips_drake.errors import UserInputError

HALF_WIDTH = 2.0
"""Shapes that come this close to the middle of the window, in x and in y [m], can be touched."""
MAX_STRAY = 0.8
"""How far the base may be from the middle, in x or y [m]: legs and body need the rest of the half width."""
RECENTRE_AT = 0.4
"""From this distance [m] on the window is moved."""
MAX_SHAPES = 2000
"""Shapes that may lie within one window: as many cost 250 MB and 3 s."""
_BLOCK = 500
"""So many windows are looked at together: pairs of windows and shapes take memory."""


class GroundWindow:
    """Decides which of n shapes can be touched, in the context of a SceneGraph; remembers nothing itself."""

    def __init__(
        self,
        scene_graph: SceneGraph,
        source: SourceId,
        ids: list[GeometryId],
        bounds: np.ndarray,
        properties: ProximityProperties,
    ):
        """Args: where the shapes are registered; by whom; their ids; ``bounds`` of each, lowest and highest x, y in W [m],
        (n, 2, 2); what they get when they can be touched.
        """
        self._scene_graph, self._source, self._ids = scene_graph, source, ids
        self._bounds, self._properties = bounds, properties

    def touchable(self, scene_context) -> np.ndarray:
        """Which shapes can be touched in this context of the SceneGraph, bool (n,)."""
        inspector = self._scene_graph.get_query_output_port().Eval(scene_context).inspector()
        return np.array([inspector.GetProximityProperties(id) is not None for id in self._ids])

    def move(self, scene_context, xy: np.ndarray) -> None:
        """Puts the middle of the window at ``xy`` (2,) in W [m]."""
        before, after = self.touchable(scene_context), is_near(self._bounds, xy)
        for i in np.flatnonzero(before & ~after):
            self._scene_graph.RemoveRole(scene_context, self._source, self._ids[i], Role.kProximity)
        for i in np.flatnonzero(after & ~before):
            self._scene_graph.AssignRole(scene_context, self._source, self._ids[i], self._properties)


def is_near(bounds: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Which shapes with ``bounds`` (n, 2, 2) reach into the square of HALF_WIDTH around ``xy`` (2,) [m], bool (n,)."""
    return ((bounds[:, 0] <= xy + HALF_WIDTH) & (bounds[:, 1] >= xy - HALF_WIDTH)).all(axis=1)


def check_density(name: str, bounds: np.ndarray) -> None:
    """Refuses the terrain ``name`` (UserInputError) if more than MAX_SHAPES lie in the window around any of its shapes."""
    middles, shapes = bounds.mean(axis=1), shapely.STRtree(shapely.box(*bounds[:, 0].T, *bounds[:, 1].T))
    for block in np.array_split(middles, -(-len(middles) // _BLOCK)):
        window, _ = shapes.query(shapely.box(*(block - HALF_WIDTH).T, *(block + HALF_WIDTH).T))
        counts = np.bincount(window, minlength=len(block))
        if counts.max() > MAX_SHAPES:
            x, y = block[counts.argmax()]
            raise UserInputError(
                f"terrain '{name}': {counts.max()} elements and triangles lie within {HALF_WIDTH:g} m of "
                f"({x:.1f}, {y:.1f}), at most {MAX_SHAPES} may: use larger ones"
            )
