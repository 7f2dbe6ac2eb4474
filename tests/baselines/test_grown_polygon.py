"""The polygon in which the MPC may put a foot: convex, inside the region, around the foothold, as large as it gets."""

import numpy as np
import pytest
import shapely

from quadpips_drake.baselines.grown_polygon import grown_polygon
from tests.baselines.hand_made import random_polygon


def is_convex(polygon) -> bool:
    edges = np.roll(polygon, -1, axis=0) - polygon
    after = np.roll(edges, -1, axis=0)
    return bool((edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0] >= -1e-9).all())


@pytest.mark.parametrize("vertices", [8, 16])
def test_random_regions(vertices):
    rng, shares = np.random.default_rng(1), []
    for _ in range(300):
        boundary = random_polygon(rng)
        shape = shapely.Polygon(boundary)
        corners = rng.dirichlet(np.ones(len(boundary)))
        point = corners @ boundary  # inside
        polygon = grown_polygon(boundary, *point, vertices, 1.05)
        if shapely.distance(shape.exterior, shapely.Point(point)) < 1e-3:
            assert len(polygon) in (0, vertices)
            continue
        assert len(polygon) == vertices and is_convex(polygon)
        found = shapely.Polygon(polygon)
        assert shape.buffer(1e-9).contains(found) and found.contains(shapely.Point(point))
        shares.append(found.area / shape.area)
    assert np.median(shares) > 0.6, np.median(shares)


def test_a_square_is_nearly_filled():
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    assert shapely.Polygon(grown_polygon(square, 0.0, 0.0, 16, 1.05)).area > 0.85 * 4.0


@pytest.mark.parametrize("point", [(1.0, 0.0), (1.2, 0.0), (0.9999, 0.3)])
def test_there_is_none_on_the_border_or_outside(point):
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    assert grown_polygon(square, *point, 16, 1.05).shape == (0, 2)
