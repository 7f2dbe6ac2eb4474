import numpy as np
import shapely

from quadpips_drake.math import polygons

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def test_hull_agrees_with_shapely():
    rng = np.random.default_rng(0)
    for n in (3, 4, 10, 300):
        points = rng.integers(0, 12, (n, 2)).astype(float)
        expected = shapely.MultiPoint(points).convex_hull
        hull = polygons.convex_hull(points)
        if expected.area == 0:
            assert len(hull) == 0
        else:
            assert shapely.Polygon(hull).equals(expected)
            assert shapely.LinearRing(hull).is_ccw


def test_hull_of_too_few_or_collinear_points_is_empty():
    assert len(polygons.convex_hull(np.zeros((2, 2)))) == 0
    assert len(polygons.convex_hull(np.column_stack((np.arange(5.0), np.arange(5.0))))) == 0
    assert len(polygons.convex_hull(np.ones((9, 2)))) == 0


def test_shrink_and_grow():
    np.testing.assert_allclose(shapely.Polygon(polygons.shrink(SQUARE, 0.2)).bounds, (0.2, 0.2, 0.8, 0.8))
    assert len(polygons.shrink(SQUARE, 0.6)) == 0
    np.testing.assert_allclose(shapely.Polygon(polygons.grow(SQUARE, 0.2)).bounds, (-0.2, -0.2, 1.2, 1.2))
    triangle = polygons.convex_hull(np.array([[0.0, 0.0], [1.0, 0.1], [0.3, 0.8]]))
    back = shapely.Polygon(polygons.shrink(polygons.grow(triangle, 0.1), 0.1))
    assert back.symmetric_difference(shapely.Polygon(triangle)).area < 1e-9


def test_half_planes_and_clipped_area():
    lines = polygons.half_planes(np.insert(SQUARE, 2, SQUARE[2], axis=0))  # with an edge of no length
    np.testing.assert_allclose(lines, [[0, -1, 0], [1, 0, 1], [0, 1, 1], [-1, 0, 0]])
    rng = np.random.default_rng(1)
    hull = polygons.convex_hull(rng.random((20, 2)))
    for angle, offset in zip(rng.uniform(0, 7, 40), rng.uniform(-1, 1, 40), strict=True):
        nx, ny = np.cos(angle), np.sin(angle)
        offset += nx / 2 + ny / 2
        part = polygons.clip_half_plane(hull, nx, ny, offset)
        np.testing.assert_allclose(
            polygons.clipped_area(hull, nx, ny, offset), polygons.area_and_centroid(part)[0], atol=1e-12
        )
    assert polygons.clipped_area(SQUARE, 1.0, 0.0, 0.25) == 0.25


def test_simplify_only_gets_smaller():
    angle = np.linspace(0, 2 * np.pi, 30, endpoint=False)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    simple = polygons.simplify(circle, 8)
    assert len(simple) == 8
    assert shapely.Polygon(circle).buffer(1e-9).contains(shapely.Polygon(simple))


def test_measures():
    area, x, y = polygons.area_and_centroid(SQUARE)
    assert (area, x, y) == (1.0, 0.5, 0.5)
    assert polygons.distance_inside(SQUARE, 0.1, 0.5) == np.float64(0.1)
    assert polygons.distance_inside(SQUARE, -0.1, 0.5) < 0
    assert polygons.distance_inside(np.empty((0, 2)), 0.0, 0.0) == -np.inf
    assert np.isnan(polygons.area_and_centroid(np.empty((0, 2)))[1])
