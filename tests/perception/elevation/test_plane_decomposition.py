"""Regions of elevation maps: on stones, stairs and slopes, over holes and gaps, and of maps that are nonsense."""

import dataclasses

import numpy as np
import pytest
import shapely

from quadpips_drake.perception.elevation.elevation_config import FINE, PAPER, PlaneConfig, with_preset
from quadpips_drake.perception.elevation.plane_decomposition import decompose_planes
from quadpips_drake.values.regions import ElevationMap
from tests.perception.elevation.maps import ideal_map, turned_height
from tests.perception.scenes import FOOT_RADIUS, Scene, corners_in_world, stepping_stones

CONFIG = with_preset(PlaneConfig(), FINE)
CLEARANCE = FOOT_RADIUS + CONFIG.margin


def regions_of(elevation, config=CONFIG, previous=None):
    return decompose_planes(elevation, FOOT_RADIUS, config, previous).regions.regions


def inset_in_world(region):
    return shapely.Polygon(corners_in_world(region, region.inset)[:, :2])


def stones(size=0.30, gap=0.10):
    """Stones over all of the map, of which none begins where a cell does."""
    pitch, at = size + gap, np.arange(-4, 4)
    corners = [(0.013 + i * pitch, 0.007 + j * pitch) for i in at for j in at]
    return Scene([[x, x + size, y, y + size, -0.4, 0.0] for x, y in corners], floor=-0.4)


@pytest.mark.parametrize("highest", [False, True])
@pytest.mark.parametrize("center", [(0.0, 0.0), (0.31, -0.17)])
def test_no_inset_over_a_gap_between_stones(center, highest):
    scene = stones()
    regions = regions_of(ideal_map(scene, center=center, highest=highest))
    tops = [region for region in regions if region.center[2] > -0.02]
    assert len(tops) >= 25
    room = shapely.union_all([shapely.box(x0, y0, x1, y1) for x0, x1, y0, y1, _, _ in scene.boxes])
    for region in tops:
        assert room.contains(inset_in_world(region)), region.center
        assert abs(region.center[2]) < 1e-6 and region.normal[2] > 1 - 1e-9
    # and each stone that is all on the map has room for a foot
    inset = shapely.union_all([inset_in_world(region) for region in tops])
    for x0, x1, y0, y1, _, _ in scene.boxes:
        if max(abs(x0 - center[0]), abs(x1 - center[0]), abs(y0 - center[1]), abs(y1 - center[1])) < 1.4:
            stone = shapely.box(x0, y0, x1, y1)
            assert inset.intersection(stone).area > 0.7 * (0.3 - 2 * CLEARANCE - 0.03) ** 2


def test_boundary_and_inset_are_foot_radius_and_margin_apart():
    for region in regions_of(ideal_map(stones())):
        boundary, inset = shapely.Polygon(region.boundary), shapely.Polygon(region.inset)
        assert inset.exterior.is_ccw and inset.contains(shapely.Point(0, 0)) and boundary.contains(inset)
        assert inset.convex_hull.area < inset.area + 1e-9
        assert inset.exterior.distance(boundary.exterior) > CLEARANCE - 1e-9
        assert inset.centroid.distance(inset.exterior) >= CONFIG.min_radius


def test_a_floor_is_covered_without_seams():
    regions = regions_of(ideal_map(Scene([])))
    covered = shapely.union_all([inset_in_world(region) for region in regions])
    assert covered.area > 0.99 * (3.0 - 2 * CLEARANCE - 0.02) ** 2
    sides = [np.sqrt(inset_in_world(region).area) for region in regions]
    assert min(sides) > 0.12 and max(sides) < 0.3


@pytest.mark.parametrize("degrees", [5, 15, 25])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_slopes_up_to_the_limit_are_regions_of_their_plane(degrees, turn):
    slope = np.tan(np.deg2rad(degrees))
    regions = regions_of(ideal_map(turned_height(lambda x, y: slope * x + 0 * y, turn)))
    assert len(regions) > 50
    normal = np.array([-slope * np.cos(turn), -slope * np.sin(turn), 1.0]) / np.hypot(1.0, slope)
    for region in regions:
        np.testing.assert_allclose(region.normal, normal, atol=1e-3)
        x, y, z = region.center
        assert z == pytest.approx(slope * (np.cos(turn) * x + np.sin(turn) * y), abs=2e-3)


def test_steep_ground_is_no_region():
    assert regions_of(ideal_map(turned_height(lambda x, y: np.tan(np.deg2rad(32)) * x + 0 * y, 0.3))) == ()


def test_connected_planes_are_told_apart():
    """A floor that becomes a ramp: one component of planar cells, two planes."""
    regions = regions_of(ideal_map(turned_height(lambda x, y: 0.36 * np.maximum(x, 0.0) + 0 * y, 0.4)))
    up = np.array([region.normal[2] for region in regions])
    flat, ramp = up > np.cos(np.deg2rad(1)), np.abs(up - np.cos(np.arctan(0.36))) < 2e-3
    assert flat.sum() > 30 and ramp.sum() > 30 and (flat | ramp).all()


def test_treads_of_stairs_keep_feet_from_both_edges():
    regions = regions_of(ideal_map(turned_height(lambda x, y: 0.15 * np.floor(x / 0.3) + 0 * y, 0.0)))
    assert len({round(region.center[2], 2) for region in regions}) >= 9
    for region in regions:
        x = corners_in_world(region, region.inset)[:, 0]
        tread = np.floor(region.center[0] / 0.3) * 0.3
        assert x.min() > tread + CLEARANCE - 0.016 and x.max() < tread + 0.3 - CLEARANCE + 0.016


def with_unknown(elevation, unknown):
    return dataclasses.replace(elevation, height=np.where(unknown, np.float32(np.nan), elevation.height))


@pytest.mark.parametrize(("width", "preset", "bridged"), [(1, FINE, True), (4, FINE, False), (4, PAPER, True)])
def test_what_was_not_seen_is_ground_only_if_it_is_narrow(width, preset, bridged):
    """The preset of the paper fills whatever hole there is, as its source does."""
    elevation = ideal_map(Scene([]))
    unknown = np.zeros(elevation.height.shape, bool)
    unknown[50 : 50 + width] = True
    regions = regions_of(with_unknown(elevation, unknown), with_preset(PlaneConfig(resample=0.0), preset))
    hole = shapely.box(0.0, -1.4, 0.03 * width, 1.4)
    touched = sum(inset_in_world(region).intersection(hole).area for region in regions) > 1e-3
    assert touched == bridged


def test_a_piece_around_a_hole_is_cut_until_it_is_convex():
    elevation = ideal_map(Scene([]))
    unknown = np.zeros(elevation.height.shape, bool)
    unknown[48:54, 49:52] = True
    hole = shapely.box(-0.06, -0.03, 0.12, 0.06)
    regions = regions_of(with_unknown(elevation, unknown))
    assert min(inset_in_world(region).distance(hole) for region in regions) > CLEARANCE - 0.016
    around = [region for region in regions if inset_in_world(region).distance(hole) < 0.1]
    assert len(around) >= 4


def test_a_region_keeps_its_id_while_the_map_travels_and_no_id_is_given_twice():
    scene = stones()
    first = decompose_planes(ideal_map(scene, center=(0.0, 0.0)), FOOT_RADIUS, CONFIG)
    second = decompose_planes(ideal_map(scene, center=(0.12, 0.06)), FOOT_RADIUS, CONFIG, first)
    place = {region.id: region.center for region in first.regions.regions}
    same = [region for region in second.regions.regions if region.id in place]
    assert len(same) > 0.8 * len(place)
    assert max(np.linalg.norm(region.center - place[region.id]) for region in same) < 0.05
    ids = [region.id for region in second.regions.regions]
    assert len(set(ids)) == len(ids) and max(ids) < second.next_id
    elsewhere = decompose_planes(ideal_map(scene, center=(20.0, 0.0)), FOOT_RADIUS, CONFIG, second)
    assert min(region.id for region in elsewhere.regions.regions) >= second.next_id


def noisy_map(seed=0):
    elevation = ideal_map(turned_height(lambda x, y: 0.1 * np.floor(x / 0.4) + 0.3 * np.maximum(y, 0), 0.2))
    noise = 0.006 * np.random.default_rng(seed).standard_normal(elevation.height.shape)
    return dataclasses.replace(elevation, height=(elevation.height + noise).astype(np.float32))


def test_the_same_seed_gives_the_same_bits():
    one, two = (regions_of(noisy_map()) for _ in range(2))
    assert len(one) == len(two) > 20
    for a, b in zip(one, two, strict=True):
        for name in ("X_WR", "boundary", "inset"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


NONSENSE = {
    "empty": lambda h: h[:0, :0],
    "nan": lambda h: np.full_like(h, np.nan),
    "infinite": lambda h: np.full_like(h, np.inf),
    "huge": lambda h: np.full_like(h, 1e30),
    "one cell": lambda h: np.where(np.arange(h.size).reshape(h.shape) == 5050, h, np.float32(np.nan)),
    "random": lambda h: np.random.default_rng(1).uniform(-1, 1, h.shape).astype(np.float32),
    "checkerboard": lambda h: np.where(np.indices(h.shape).sum(axis=0) % 2, h, np.float32(0.5)),
}


@pytest.mark.parametrize("preset", [FINE, PAPER])
@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_raises_nothing_and_is_no_ground(name, preset):
    elevation = ideal_map(Scene([]))
    height = NONSENSE[name](elevation.height)
    bad = dataclasses.replace(elevation, height=height, variance=np.zeros_like(height))
    regions = regions_of(bad, with_preset(PlaneConfig(), preset))
    assert len(regions) == 0 or name == "huge" or (preset == PAPER and name in ("one cell", "checkerboard"))
    assert all(np.isfinite(region.X_WR).all() for region in regions)
    assert regions_of(ElevationMap.empty()) == ()


def test_the_scene_of_the_other_tests_has_stones_ahead():
    regions = regions_of(ideal_map(stepping_stones(), center=(1.0, 0.0)))
    assert sum(region.center[0] > 0.85 and region.center[2] > -0.1 for region in regions) >= 12
