"""The visible patches of a terrain as they are defined: face by face, each against all elements. For tests."""

import numpy as np
import shapely

from quadpips_drake.terrain.surfaces import SurfacePatch, _rings
from quadpips_drake.terrain.terrain import Box, Cylinder, Sphere
from quadpips_drake.terrain.triangles import BOX_FACES, sphere_triangles

_SIDES, _FLUSH, _MIN_AREA = 64, 1e-6, 1e-8


def visible_patches(elements) -> tuple[SurfacePatch, ...]:
    """What ``surfaces.visible_patches`` returns, in the same order and to the bit."""
    solids = [solid for element in elements for solid in _solids(element)]
    tree = shapely.STRtree([shapely.MultiPoint(corners[:, :2]).envelope for corners, _ in solids])
    groups, planes = {}, {}
    for element in elements:
        for corners in _upward_faces(element):
            normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            normal = normal / np.linalg.norm(normal)
            offset = float(normal @ corners.mean(axis=0))
            polygon = shapely.Polygon(corners[:, :2])
            hidden = [_shadow_above(*solids[k], normal, offset) for k in tree.query(polygon)]
            visible = polygon.difference(shapely.union_all([shadow for shadow in hidden if shadow is not None]))
            if visible.area > _MIN_AREA:
                key = (*np.round(normal, 6), round(offset, 6), element.label)
                groups.setdefault(key, []).append(visible)
                planes.setdefault(key, (normal, offset))
    return tuple(
        SurfacePatch(polygon, *planes[key], key[-1])
        for key, pieces in groups.items()
        for polygon in shapely.get_parts(shapely.union_all(pieces, grid_size=1e-7))
        if isinstance(polygon, shapely.Polygon) and polygon.area > _MIN_AREA
    )


def _shadow_above(corners, edges, normal, offset):
    """Projection on xy of the part of a convex solid above a plane, None if there is none."""
    above = (corners @ normal - offset) / normal[2]
    if above.max() < _FLUSH:
        return None
    points = [corners[above >= 0]]
    for start, end in edges:
        if (above[start] < 0) != (above[end] < 0):
            fraction = above[start] / (above[start] - above[end])
            points.append((corners[start] + fraction * (corners[end] - corners[start]))[None])
    hull = shapely.MultiPoint(np.concatenate(points)[:, :2]).convex_hull
    return hull if hull.area > _MIN_AREA else None


def _upward_faces(element):
    if isinstance(element, Sphere):
        return []
    if isinstance(element, Box):
        faces = [element.corners()[face] for face in BOX_FACES]
    elif isinstance(element, Cylinder):
        bottom, top = _rings(element)
        faces = [top, bottom[::-1]]
    else:
        faces = list(element.corners()[element.triangles])
        faces += [face[::-1] for face in faces]
    return [face for face in faces if _area(face)[2] > max(_MIN_AREA, 1e-3 * np.linalg.norm(_area(face)))]


def _area(face):
    return 0.5 * np.cross(face[1:-1] - face[0], face[2:] - face[0]).sum(axis=0)


def _solids(element):
    """Convex pieces: corners in W and edges between them."""
    if isinstance(element, Box):
        return [(element.corners(), [(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit])]
    if isinstance(element, Cylinder):
        around = [(i, (i + 1) % _SIDES) for i in range(_SIDES)]
        across = [(i, i + _SIDES) for i in range(_SIDES)]
        edges = [*around, *((a + _SIDES, b + _SIDES) for a, b in around), *across]
        return [(np.concatenate(_rings(element)), edges)]
    if isinstance(element, Sphere):
        corners, faces = sphere_triangles(element, _SIDES)
        return [(corners, sorted({tuple(sorted((int(f[i]), int(f[i - 1])))) for f in faces for i in range(3)}))]
    return [(corners, [(0, 1), (1, 2), (2, 0)]) for corners in element.corners()[element.triangles]]
