"""The flat pieces of a terrain's surface that are visible from above, computed exactly with polygons.

Every upward face of an element is a polygon in the plane; what hides it is the projection of the parts of other elements
that lie above its plane. Convex elements make both exact; cylinders count as prisms of 64 sides, spheres, which have no flat
pieces of their own, as polyhedra of 64 sides around.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import shapely

from quadpips_drake.terrain.terrain import Box, Cylinder, Element, Sphere
from quadpips_drake.terrain.triangles import BOX_FACES, sphere_triangles, unit_sphere
from quadpips_drake.values.steppability import Steppability

_SIDES = 64
_FLUSH = 1e-6
"""Heights and distances below this [m] count as none."""
_MIN_AREA = 1e-8
_BOX_EDGES = np.array([(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit])
"""Between the corners of a box, (12, 2)."""


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
        X_WP[:3, :3] = np.column_stack((x_axis, _cross(self.normal, x_axis), self.normal))
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

    @cached_property
    def _frames(self) -> list[np.ndarray]:
        return [patch.frame() for patch in self.patches]

    @cached_property
    def _edges(self) -> list[shapely.Geometry]:
        return [patch.in_plane(X_WP).boundary for patch, X_WP in zip(self.patches, self._frames, strict=True)]

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
    faces, labels = [], []
    for element in elements:
        upward = _upward_faces(element)
        faces += upward
        labels += [element.label] * len(upward)
    if not faces:
        return ()
    planes = [_plane(face) for face in faces]
    outlines = _polygons(faces)
    visible = shapely.difference(outlines, _hidden_parts(elements, outlines, planes))
    groups: dict[tuple, list[shapely.Geometry]] = {}
    first: dict[tuple, tuple[np.ndarray, float]] = {}
    rounded = np.round([(*normal, offset) for normal, offset in planes], 6).tolist()
    for k in np.flatnonzero(shapely.area(visible) > _MIN_AREA):
        key = (*rounded[k], labels[k])
        groups.setdefault(key, []).append(visible[k])
        first.setdefault(key, planes[k])
    patches = []
    for key, pieces in groups.items():
        # Snapping to a fine grid closes the cracks of rounding between flush neighbours.
        joined = shapely.union_all(pieces, grid_size=1e-7)
        for polygon in shapely.get_parts(joined):
            if isinstance(polygon, shapely.Polygon) and polygon.area > _MIN_AREA:
                patches.append(SurfacePatch(polygon, *first[key], key[-1]))
    return tuple(patches)


def _polygons(faces: list[np.ndarray]) -> np.ndarray:
    """The projections of ``faces`` on xy as an array of polygons."""
    owners = np.repeat(np.arange(len(faces)), [len(face) for face in faces])
    return shapely.polygons(shapely.linearrings(np.concatenate(faces)[:, :2], indices=owners))


def _hidden_parts(elements: tuple[Element, ...], outlines: np.ndarray, planes: list[tuple[np.ndarray, float]]) -> np.ndarray:
    """What other elements hide of faces with these ``outlines`` and ``planes``: an array of geometries, empty ones too."""
    solids = [solid for element in elements for solid in _solids(element)]
    low = np.array([corners.min(axis=0) for corners, _ in solids])
    high = np.array([corners.max(axis=0) for corners, _ in solids])
    face, solid = shapely.STRtree(shapely.box(*low[:, :2].T, *high[:, :2].T)).query(outlines)
    # Most neighbours do not reach above the plane; their bounds tell it for all of them at once.
    normal, offset = np.array([plane[0] for plane in planes])[face], np.array([plane[1] for plane in planes])[face]
    top = (np.where(normal > 0.0, high[solid], low[solid]) * normal).sum(axis=1) - offset
    reaches = top > 0.5 * _FLUSH * normal[:, 2]
    pairs = zip(face[reaches].tolist(), solid[reaches].tolist(), strict=True)
    above = [(k, _points_above(*solids[s], *planes[k])) for k, s in pairs]
    above = [(k, points) for k, points in above if len(points) > 0]
    hidden = np.full(len(outlines), shapely.union_all([]))
    for k, shadows in _shadows(above).items():
        hidden[k] = shapely.union_all(shadows)
    return hidden


def _shadows(above: list[tuple[int, np.ndarray]]) -> dict[int, list[shapely.Geometry]]:
    """Convex hulls of the ``above`` sets of points (n, 2), by the key that each of them comes with."""
    if not above:
        return {}
    owners = np.repeat(np.arange(len(above)), [len(points) for _, points in above])
    points = shapely.points(np.concatenate([points for _, points in above]))
    hulls = shapely.convex_hull(shapely.multipoints(points, indices=owners))
    shadows: dict[int, list[shapely.Geometry]] = {}
    for i in np.flatnonzero(shapely.area(hulls) > _MIN_AREA):
        shadows.setdefault(above[i][0], []).append(hulls[i])
    return shadows


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The cross products of vectors (..., 3); for a few of them NumPy's takes ten times as long."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def _plane(corners: np.ndarray) -> tuple[np.ndarray, float]:
    normal = _cross(corners[1] - corners[0], corners[2] - corners[0])
    normal = normal / np.linalg.norm(normal)
    return normal, float(normal @ corners.mean(axis=0))


def _points_above(corners: np.ndarray, edges: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """Corners of the part of a convex solid above a plane, projected on xy, (n, 2); none where it does not rise above it."""
    above = (corners @ normal - offset) / normal[2]
    if above.max() < _FLUSH:
        return np.zeros((0, 2))
    start, end = edges.T
    below = above < 0
    crossing = np.flatnonzero(below[start] != below[end])
    start, end = start[crossing], end[crossing]
    fraction = above[start] / (above[start] - above[end])
    middle = corners[start] + fraction[:, None] * (corners[end] - corners[start])
    return np.concatenate((corners[above >= 0], middle))[:, :2]


def _upward_faces(element: Element) -> list[np.ndarray]:
    """Flat faces that look upwards: corners in W, (k, 3), counter-clockwise from above."""
    if isinstance(element, Sphere):
        return []
    if isinstance(element, Box):
        faces = element.corners()[BOX_FACES]
    elif isinstance(element, Cylinder):
        bottom, top = _rings(element)
        faces = np.stack((top, bottom[::-1]))
    else:
        # Triangles count whichever way they wind: seen from above a surface is a surface.
        triangles = element.corners()[element.triangles]
        faces = np.concatenate((triangles, triangles[:, ::-1]))
    areas = 0.5 * _cross(faces[:, 1:-1] - faces[:, :1], faces[:, 2:] - faces[:, :1]).sum(axis=1)
    upward = areas[:, 2] > np.maximum(_MIN_AREA, 1e-3 * np.linalg.norm(areas, axis=1))
    return list(faces[upward])


def _solids(element: Element) -> list[tuple[np.ndarray, np.ndarray]]:
    """Convex pieces: corners in W (n, 3) and edges between them (m, 2)."""
    if isinstance(element, Box):
        return [(element.corners(), _BOX_EDGES)]
    if isinstance(element, Cylinder):
        i = np.arange(_SIDES)
        around = np.column_stack((i, (i + 1) % _SIDES))
        edges = np.concatenate((around, around + _SIDES, np.column_stack((i, i + _SIDES))))
        return [(np.concatenate(_rings(element)), edges)]
    if isinstance(element, Sphere):
        return [(sphere_triangles(element, _SIDES)[0], _sphere_edges())]
    edges = np.array([(0, 1), (1, 2), (2, 0)])
    return [(corners, edges) for corners in element.corners()[element.triangles]]


@cache
def _sphere_edges() -> np.ndarray:
    """Between the corners of the polyhedron that stands for a sphere, (m, 2)."""
    _, faces = unit_sphere(_SIDES)
    return np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def _rings(cylinder: Cylinder) -> tuple[np.ndarray, np.ndarray]:
    """Corners (64, 3) in W of the bottom and the top of the prism that stands for a cylinder."""
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    circle = cylinder.radius * np.column_stack((np.cos(angle), np.sin(angle)))
    half = np.full((_SIDES, 1), 0.5 * cylinder.length)
    rings = [np.column_stack((circle, sign * half)) for sign in (-1, 1)]
    return tuple(ring @ cylinder.X_WE[:3, :3].T + cylinder.X_WE[:3, 3] for ring in rings)
