import numpy as np
import pytest
import shapely

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.regions.oracle_regions import (
    OracleRegionConfig,
    centers_of,
    nearby_regions,
    regions_from_terrain,
)
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.terrain import Box, Terrain, pose
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.steppability import Steppability
from tests.perception.scenes import FOOT_RADIUS, corners_in_world


@pytest.mark.parametrize("name", ["stepping_stones", "stairs", "ramp_10"])
def test_regions_lie_on_the_terrain_and_keep_off_its_edges(name):
    terrain, config = load_terrain(name), OracleRegionConfig()
    truth, regions = GroundTruth(terrain), regions_from_terrain(terrain, FOOT_RADIUS, config)
    assert [region.id for region in regions] == list(range(len(regions))) and len(regions) > 50
    corners = np.concatenate([corners_in_world(region, region.inset) for region in regions])
    np.testing.assert_allclose(corners[:, 2], truth.height(corners[:, 0], corners[:, 1]), atol=1e-6)
    assert truth.distance_to_edge(corners[:, 0], corners[:, 1]).min() > FOOT_RADIUS + config.margin - 1e-3
    for region in regions[::20]:
        inset, boundary = shapely.Polygon(region.inset), shapely.Polygon(region.boundary)
        assert shapely.LinearRing(region.inset).is_ccw and inset.contains(shapely.Point(0, 0))
        assert inset.convex_hull.area == pytest.approx(inset.area) and boundary.contains(inset)
        assert truth.normal(*region.center[:2]) @ region.normal == pytest.approx(1.0)


def test_what_must_not_be_stepped_on_gives_no_region():
    floor = Box(X_WE=pose((0, 0, -0.05)), size=np.array([2.0, 2.0, 0.1]))
    puddle = Box(X_WE=pose((0.5, 0, 0.0)), size=np.array([0.4, 0.4, 0.02]), label=Steppability.NON_PASSABLE)
    terrain = Terrain("puddle", np.zeros(3), np.array([1.0, 0.0]), 0.7, (floor, puddle))
    regions = regions_from_terrain(terrain, FOOT_RADIUS, OracleRegionConfig())
    wet = shapely.box(0.3, -0.2, 0.7, 0.2)
    assert len(regions) > 50
    assert all(not wet.intersects(shapely.Polygon(corners_in_world(r, r.boundary)[:, :2]).buffer(-1e-6)) for r in regions)


def test_with_every_label_the_puddle_is_a_region_and_says_so():
    floor = Box(X_WE=pose((0, 0, -0.05)), size=np.array([2.0, 2.0, 0.1]))
    puddle = Box(X_WE=pose((0.5, 0, 0.0)), size=np.array([0.4, 0.4, 0.02]), label=Steppability.NON_PASSABLE)
    terrain = Terrain("puddle", np.zeros(3), np.array([1.0, 0.0]), 0.7, (floor, puddle))
    regions = regions_from_terrain(terrain, FOOT_RADIUS, OracleRegionConfig(), every_label=True)
    wet = [region for region in regions if np.abs(region.center[:2] - [0.5, 0.0]).max() < 0.2]
    assert wet and {region.label for region in wet} == {Steppability.NON_PASSABLE}
    dry = regions_from_terrain(terrain, FOOT_RADIUS, OracleRegionConfig())
    assert len(dry) == len(regions) - len(wet)


def test_only_nearby_regions_are_known():
    regions = regions_from_terrain(load_terrain("flat"), FOOT_RADIUS, OracleRegionConfig(cell=0.5))
    near = nearby_regions(regions, np.array([1.0, 0.2, 0.5]), 1.5)
    assert nearby_regions(regions, np.array([1.0, 0.2, 0.5]), 1.5, centers_of(regions)) == near
    assert 0 < len(near) < len(regions)
    assert all(np.hypot(*(region.center[:2] - [1.0, 0.2])) <= 1.5 for region in near)
    assert nearby_regions(regions, np.array([np.nan, 0, 0]), 1.5) == ()
    with pytest.raises(UserInputError):
        OracleRegionConfig(cell=0.0)
