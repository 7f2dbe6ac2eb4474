"""What was made faster for terrains of thousands of elements, against how it is defined."""

import gc
import weakref

import numpy as np
import pytest
from pydrake.geometry import Role

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain import ground_window
from quadpips_drake.terrain.ground_window import HALF_WIDTH, check_density
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.raycast import ElementArrays, cast_down
from quadpips_drake.terrain.surfaces import visible_patches
from quadpips_drake.terrain.terrain import Box, Cylinder, Terrain, pose
from quadpips_drake.terrain.triangles import in_memory_mesh
from quadpips_drake.terrain.truth import GroundTruth
from tests.terrain import reference_surfaces
from tests.terrain.test_large_terrains import hill, make_station, terrain_shapes, tiles
from tests.terrain.test_truth import rubble


def scattered(count: int, size: float, seed: int = 0) -> Terrain:
    """Tilted boxes and cylinders all over a plate that is much larger than they are."""
    rng = np.random.default_rng(seed)
    elements = [Box(size=(20.0, 20.0, 0.2), X_WE=pose((0, 0, -0.1)))]
    for _ in range(count):
        where = pose((*rng.uniform(-4, 4, 2), rng.uniform(0, 0.3)), rng.uniform(-1, 1, 3))
        if rng.random() < 0.5:
            elements.append(Box(size=rng.uniform(0.2, 1.0, 3) * size, X_WE=where))
        else:
            elements.append(Cylinder(radius=0.5 * size, length=size, X_WE=where))
    return Terrain("scattered", (0, 0, 0), (1, 0), 1.0, tuple(elements))


WORLDS = {
    "rubble": lambda: rubble(1, 40),
    "tiles": lambda: tiles(120, 0.3),
    "hill": lambda: Terrain("hill", (0, 0, 0), (1, 0), 1.0, (hill(8, 3.0), Box(size=(1, 1, 0.1)))),
    "scattered": lambda: scattered(200, 0.3),
    "crowded": lambda: scattered(150, 6.0),
    "stones": lambda: load_terrain("sparse_stones", seed=5),
    "one": lambda: Terrain("one", (0, 0, 0), (1, 0), 1.0, (Box(size=(1, 1, 1)),)),
}


@pytest.mark.parametrize("name", WORLDS)
def test_a_ray_meets_what_it_meets_among_all_elements(name):
    terrain = WORLDS[name]()
    low, high = (bound[:2] for bound in terrain.bounds())
    rng = np.random.default_rng(0)
    corners = np.concatenate([element.corners()[:, :2] for element in terrain.elements])  # on borders, too
    points = np.concatenate((rng.uniform(low - 0.1, high + 0.1, (1500, 2)), rng.permutation(corners)[:500], [low, high]))
    heights, elements, normals = cast_down(*points.T, ElementArrays(terrain))
    best, owner, up = np.full(len(points), np.nan), np.full(len(points), -1), np.full((len(points), 3), np.nan)
    for k in range(len(terrain.elements)):
        one = ElementArrays(terrain, keep=np.arange(len(terrain.elements)) == k)
        z, _, normal = cast_down(*points.T, one)
        higher = ~np.isnan(z) & ~(z <= best)
        best[higher], owner[higher], up[higher] = z[higher], k, normal[higher]
    np.testing.assert_array_equal(heights, best)
    np.testing.assert_array_equal(elements, owner)
    np.testing.assert_array_equal(normals, up)


def test_a_ray_nowhere_meets_nothing():
    for terrain in (tiles(50), load_terrain("flat")):
        truth = GroundTruth(terrain)
        assert np.isnan(truth.height([np.nan, 0.0, np.inf, -np.inf], [0.0, np.nan, 0.0, 1e300])).all()
        assert (truth.element([np.nan, np.inf], 0.0) == -1).all()
    pit = Terrain("pit", (0, 0, 0), (1, 0), 1.0, (Box(size=(1, 1, 1), label=3),))
    assert np.isnan(GroundTruth(pit).height(0.0, 0.0, walkable_only=True)), "no element is left"


@pytest.mark.parametrize("name", WORLDS)
def test_patches_are_those_of_the_definition(name):
    terrain = WORLDS[name]()
    mine, expected = visible_patches(terrain.elements), reference_surfaces.visible_patches(terrain.elements)
    assert len(mine) == len(expected) > 0
    for patch, other in zip(mine, expected, strict=True):
        assert patch.polygon.wkb == other.polygon.wkb
        np.testing.assert_array_equal(patch.normal, other.normal)
        assert (patch.offset, patch.label) == (other.offset, other.label)


def test_all_who_ask_share_what_is_known_of_a_terrain_as_long_as_it_lives():
    terrain = load_terrain("stairs")
    assert GroundTruth(terrain).patches is GroundTruth(terrain).patches
    assert GroundTruth(load_terrain("stairs")).patches is not GroundTruth(terrain).patches
    patch = weakref.ref(GroundTruth(terrain).patches[0])
    del terrain
    gc.collect()
    assert patch() is None


def test_density_is_counted_in_the_window_around_each_shape(monkeypatch):
    rng = np.random.default_rng(3)
    middles, halves = rng.uniform(-8, 8, (700, 2)), rng.uniform(0.05, 1.0, (700, 2))
    bounds = np.stack((middles - halves, middles + halves), axis=1)
    counts = [
        int(((bounds[:, 0] <= m + HALF_WIDTH) & (bounds[:, 1] >= m - HALF_WIDTH)).all(axis=1).sum())
        for m in bounds.mean(axis=1)
    ]
    monkeypatch.setattr(ground_window, "MAX_SHAPES", max(counts))
    check_density("field", bounds)
    monkeypatch.setattr(ground_window, "MAX_SHAPES", max(counts) - 1)
    with pytest.raises(UserInputError, match=f"terrain 'field': {max(counts)} elements"):
        check_density("field", bounds)


def test_cameras_need_nothing_to_touch():
    station = make_station(load_terrain("stepping_stones"))
    camera_scene = station.GetSubsystemByName("camera_scene")
    assert terrain_shapes(camera_scene, Role.kProximity) == []
    assert len(terrain_shapes(camera_scene, Role.kPerception)) == 1, "drawn as one mesh"
    assert len(terrain_shapes(station.scene_graph, Role.kProximity)) == 27


def test_triangles_are_written_with_nine_digits():
    vertices = np.array([[0.1 + 0.2, 1e-12, -2.0 / 3.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1e6]])
    lines = in_memory_mesh(vertices, np.array([[0, 1, 2]])).mesh_file.contents().decode().splitlines()
    assert lines[:3] == [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    assert lines[-1] == "f 1//1 2//1 3//1"
