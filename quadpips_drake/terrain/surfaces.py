"""The flat pieces of a terrain's surface that are visible from above, computed exactly with polygons.

Every upward face of an element is a polygon in the plane; what hides it is the projection of the parts of other elements
that lie above its plane. Convex elements make both exact; cylinders count as prisms of 64 sides.
"""

from dataclasses import dataclass

import numpy as np
import shapely

from quadpips_drake.terrain.terrain import Box, Cylinder, Element
from quadpips_drake.terrain.triangles import BOX_FACES
from quadpips_drake.values.steppability import Steppability

_SIDES = 64
_FLUSH = 1e-6
"""Heights and distances below this [m] count as none."""
_MIN_AREA = 1e-8


@dataclass(frozen=True, eq=False)
class SurfacePatch:
    """A connected flat piece of the visible surface."""

    polygon: shapely.Polygon
    """Its projection on the xy plane of W [m], possibly with holes."""
    normal: np.ndarray
    """Upward unit normal in W, (3,)."""
    offset: float
    """normal . p = offset [m] for all points p of the patch."""
    label: Steppability

    @property
    def is_walkable(self) -> bool:
        """Whether feet are meant to stand here."""
        return self.label in (Steppability.STEPPABLE, Steppability.UNKNOWN)

    def height(self, x, y) -> np.ndarray:
        """Height of the patch's plane [m] at x, y."""
        return (self.offset - self.normal[0] * np.asarray(x) - self.normal[1] * np.asarray(y)) / self.normal[2]

    def frame(self) -> np.ndarray:
        """Pose X_WP (4, 4): z is the normal, x lies in the world's xz plane (as far as possible), origin in the polygon."""
        x_axis = np.array([self.normal[2], 0.0, -self.normal[0]])
        x_axis /= np.linalg.norm(x_axis)
        X_WP = np.eye(4)
        X_WP[:3, :3] = np.column_stack((x_axis, np.cross(self.normal, x_axis), self.normal))
        point = self.polygon.representative_point()
        X_WP[:3, 3] = point.x, point.y, self.height(point.x, point.y)
        return X_WP

    def in_plane(self, X_WP: np.ndarray | None = None) -> shapely.Polygon:
        """The patch [m] in the xy plane of its frame."""
        X_WP = self.frame() if X_WP is None else X_WP

        def to_frame(xy):
            points = np.column_stack((xy, self.height(xy[:, 0], xy[:, 1]))) - X_WP[:3, 3]
            return points @ X_WP[:3, :2]

        return shapely.transform(self.polygon, to_frame)


class PatchIndex:
    """Answers point queries on a set of patches."""

    def __init__(self, patches: tuple[SurfacePatch, ...]):
        self.patches = patches
        self._tree = shapely.STRtree([patch.polygon for patch in patches])
        self._frames = [patch.frame() for patch in patches]
        self._edges = [patch.in_plane(X_WP).boundary for patch, X_WP in zip(patches, self._frames, strict=True)]

    def distance_to_edge(self, points: np.ndarray, heights: np.ndarray) -> np.ndarray:
        """Distance [m] to the edge of the patch on which (x, y) ``points`` (n, 2) at ``heights`` (n,) lie; 0 on none."""
        distance = np.zeros(len(points))
        point_index, patch_index = self._tree.query(shapely.points(points), predicate="intersects")
        for k in np.unique(patch_index):
            here = point_index[patch_index == k]
            on_patch = np.abs(self.patches[k].height(*points[here].T) - heights[here]) < _FLUSH
            here = here[on_patch]
            p_WQ = np.column_stack((points[here], heights[here]))
            X_WP = self._frames[k]
            in_plane = shapely.points((p_WQ - X_WP[:3, 3]) @ X_WP[:3, :2])
            distance[here] = np.maximum(distance[here], shapely.distance(self._edges[k], in_plane))
        return distance

    def nearest_height(self, points: np.ndarray) -> np.ndarray:
        """Height [m] (n,) of the patch that is horizontally nearest to each of ``points`` (n, 2); NaN without patches."""
        if not self.patches:
            return np.full(len(points), np.nan)
        heights = np.empty(len(points))
        for i, (point, k) in enumerate(zip(shapely.points(points), self._tree.nearest(shapely.points(points)), strict=True)):
            line = shapely.shortest_line(self.patches[k].polygon, point)
            heights[i] = self.patches[k].height(*shapely.get_coordinates(line)[0])
        return heights


def visible_patches(elements: tuple[Element, ...]) -> tuple[SurfacePatch, ...]:
    """Returns the visible flat patches of ``elements``, flush coplanar neighbours of one label joined."""
    solids = [solid for element in elements for solid in _solids(element)]
    tree = shapely.STRtree([shapely.MultiPoint(corners[:, :2]).envelope for corners, _ in solids])
    groups: dict[tuple, list[shapely.Geometry]] = {}
    planes: dict[tuple, tuple[np.ndarray, float]] = {}
    for element in elements:
        for corners in _upward_faces(element):
            normal, offset = _plane(corners)
            polygon = shapely.Polygon(corners[:, :2])
            hidden = [_shadow_above(*solids[k], normal, offset) for k in tree.query(polygon)]
            visible = polygon.difference(shapely.union_all([shadow for shadow in hidden if shadow is not None]))
            if visible.area > _MIN_AREA:
                key = (*np.round(normal, 6), round(offset, 6), element.label)
                groups.setdefault(key, []).append(visible)
                planes.setdefault(key, (normal, offset))
    patches = []
    for key, pieces in groups.items():
        # Snapping to a fine grid closes the cracks of rounding between flush neighbours.
        joined = shapely.union_all(pieces, grid_size=1e-7)
        for polygon in shapely.get_parts(joined):
            if isinstance(polygon, shapely.Polygon) and polygon.area > _MIN_AREA:
                patches.append(SurfacePatch(polygon, *planes[key], key[-1]))
    return tuple(patches)


def _plane(corners: np.ndarray) -> tuple[np.ndarray, float]:
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal = normal / np.linalg.norm(normal)
    return normal, float(normal @ corners.mean(axis=0))


def _shadow_above(corners: np.ndarray, edges: np.ndarray, normal: np.ndarray, offset: float) -> shapely.Geometry | None:
    """Projection on xy of the part of a convex solid above a plane, None if there is none."""
    above = (corners @ normal - offset) / normal[2]
    if above.max() < _FLUSH:
        return None
    points = [corners[above >= 0]]
    start, end = edges.T
    crossing = np.flatnonzero((above[start] < 0) != (above[end] < 0))
    start, end = start[crossing], end[crossing]
    fraction = above[start] / (above[start] - above[end])
    points.append(corners[start] + fraction[:, None] * (corners[end] - corners[start]))
    hull = shapely.MultiPoint(np.concatenate(points)[:, :2]).convex_hull
    return hull if hull.area > _MIN_AREA else None


def _upward_faces(element: Element) -> list[np.ndarray]:
    """Flat faces that look upwards: corners in W, (k, 3), counter-clockwise from above."""
    if isinstance(element, Box):
        corners = element.corners()
        faces = [corners[face] for face in BOX_FACES]
    elif isinstance(element, Cylinder):
        bottom, top = _rings(element)
        faces = [top, bottom[::-1]]
    else:
        # Triangles count whichever way they wind: seen from above a surface is a surface.
        faces = list(element.corners()[element.triangles])
        faces += [face[::-1] for face in faces]
    return [face for face in faces if _area_vector(face)[2] > max(_MIN_AREA, 1e-3 * np.linalg.norm(_area_vector(face)))]


def _area_vector(face: np.ndarray) -> np.ndarray:
    return 0.5 * np.cross(face[1:-1] - face[0], face[2:] - face[0]).sum(axis=0)


def _solids(element: Element) -> list[tuple[np.ndarray, np.ndarray]]:
    """Convex pieces: corners in W (n, 3) and edges between them (m, 2)."""
    if isinstance(element, Box):
        edges = [(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit]
        return [(element.corners(), np.array(edges))]
    if isinstance(element, Cylinder):
        i = np.arange(_SIDES)
        around = np.column_stack((i, (i + 1) % _SIDES))
        edges = np.concatenate((around, around + _SIDES, np.column_stack((i, i + _SIDES))))
        return [(np.concatenate(_rings(element)), edges)]
    edges = np.array([(0, 1), (1, 2), (2, 0)])
    return [(corners, edges) for corners in element.corners()[element.triangles]]


def _rings(cylinder: Cylinder) -> tuple[np.ndarray, np.ndarray]:
    """Corners (64, 3) in W of the bottom and the top of the prism that stands for a cylinder."""
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    circle = cylinder.radius * np.column_stack((np.cos(angle), np.sin(angle)))
    half = np.full((_SIDES, 1), 0.5 * cylinder.length)
    rings = [np.column_stack((circle, sign * half)) for sign in (-1, 1)]
    return tuple(ring @ cylinder.X_WE[:3, :3].T + cylinder.X_WE[:3, 3] for ring in rings)
