"""Ground truth against Drake's distance queries and against dense sampling."""

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from quadpips_drake.terrain.library import load_terrain, stairs, stepping_stones
from quadpips_drake.terrain.plant_builder import add_terrain_to_plant
from quadpips_drake.terrain.terrain import Box, Cylinder, Mesh, Sphere, Terrain, pose
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.steppability import Steppability

OCTAHEDRON = (
    [[0.3, 0, 0], [-0.3, 0, 0], [0, 0.3, 0], [0, -0.3, 0], [0, 0, 0.2], [0, 0, -0.2]],
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
)


def rubble(seed: int = 0, count: int = 25) -> Terrain:
    """Tilted, overlapping boxes, cylinders, a convex mesh and spheres on a plate."""
    rng = np.random.default_rng(seed)
    elements = [Box(name="plate", size=(3.0, 3.0, 0.2), X_WE=pose((0, 0, -0.1)))]
    for _ in range(count):
        where = pose((*rng.uniform(-1.2, 1.2, 2), rng.uniform(-0.05, 0.2)), rng.uniform(-0.6, 0.6, 3))
        if rng.random() < 0.6:
            elements.append(Box(size=rng.uniform(0.1, 0.5, 3), X_WE=where))
        else:
            elements.append(Cylinder(radius=rng.uniform(0.05, 0.2), length=rng.uniform(0.1, 0.5), X_WE=where))
    vertices, triangles = OCTAHEDRON
    elements.append(Mesh(vertices=vertices, triangles=triangles, X_WE=pose((0.3, 0.2, 0.4), (0.3, 0.2, 1.0))))
    elements += [Sphere(radius=r, X_WE=pose(where)) for r, where in ((0.25, (-0.5, 0.4, 0.1)), (0.15, (0.6, -0.5, 0.3)))]
    return Terrain("rubble", (0, 0, 0), (1, 0), 1.0, tuple(elements))


def signed_distance_query(terrain: Terrain):
    """Returns a function from a point to its distance to the nearest collision geometry (negative inside)."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    add_terrain_to_plant(terrain, plant, scene_graph)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context))
    keep = (diagram, context)
    return lambda p, keep=keep: min(hit.distance for hit in query.ComputeSignedDistanceToPoint(p))


def test_surface_is_where_drake_says():
    terrain = rubble()
    truth, distance = GroundTruth(terrain), signed_distance_query(terrain)
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1.4, 1.4, (2, 150))
    heights, normals = truth.height(x, y), truth.normal(x, y)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    assert (normals[:, 2] > 0).all()
    for i in range(len(x)):
        point = np.array([x[i], y[i], heights[i]])
        assert abs(distance(point)) < 1e-6, "the point lies on the surface"
        assert distance(point - 1e-4 * normals[i]) < 0, "below it is inside"
        for lift in (1e-4, 0.02, 0.1, 0.3):
            assert distance(point + np.array([0, 0, lift])) > 0, "nothing lies above it"


def test_open_mesh_collides_like_its_triangles():
    x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4))
    z = 0.2 * np.sin(3 * x) * np.cos(2 * y)
    vertices = np.column_stack((x.ravel(), y.ravel(), z.ravel()))
    i, j = (g.ravel() for g in np.meshgrid(range(3), range(3)))
    a = 4 * j + i
    triangles = np.concatenate((np.column_stack((a, a + 1, a + 5)), np.column_stack((a, a + 5, a + 4))))
    terrain = Terrain("hill", (0, 0, 0), (1, 0), 1.0, (Mesh(vertices=vertices, triangles=triangles),))
    truth, distance = GroundTruth(terrain), signed_distance_query(terrain)
    for px, py in np.random.default_rng(0).uniform(0.02, 0.98, (40, 2)):
        point = np.array([px, py, truth.height(px, py)])
        assert abs(distance(point)) < 1e-6


def test_distance_to_edge_against_dense_sampling():
    terrain = rubble(seed=3, count=14)
    truth = GroundTruth(terrain)
    rng = np.random.default_rng(2)
    step = 0.008
    offsets = np.arange(-0.4, 0.4 + step, step)
    dx, dy = (g.ravel() for g in np.meshgrid(offsets, offsets))
    checked = 0
    for x, y in rng.uniform(-1.3, 1.3, (60, 2)):
        element = terrain.elements[truth.element(x, y)]
        if isinstance(element, Cylinder | Sphere):
            continue
        normal = truth.normal(x, y)
        dz = -(normal[0] * dx + normal[1] * dy) / normal[2]
        elsewhere = ~(np.abs(truth.height(x + dx, y + dy) - truth.height(x, y) - dz) < 1e-6)
        if not elsewhere.any():
            continue
        sampled = np.sqrt(dx**2 + dy**2 + dz**2)[elsewhere].min()
        assert truth.distance_to_edge(x, y) == pytest.approx(sampled, abs=2 * step / normal[2])
        checked += 1
    assert checked > 30


def test_flush_neighbours_share_no_edge():
    halves = tuple(Box(size=(1.0, 1.0, 0.1), X_WE=pose((0.5 + i, 0, -0.05))) for i in range(2))
    truth = GroundTruth(Terrain("two", (0, 0, 0), (1, 0), 1.0, halves))
    assert truth.distance_to_edge(1.0, 0.0) == pytest.approx(0.5, abs=1e-6)
    assert np.isnan(truth.distance_to_edge(3.0, 0.0))


def test_queries_broadcast_and_mark_the_void():
    truth = GroundTruth(stepping_stones())
    assert truth.height(np.zeros((2, 3)), 0.0).shape == (2, 3)
    assert truth.normal(np.zeros((2, 3)), 0.0).shape == (2, 3, 3)
    assert np.isnan(truth.height(50.0, 0.0))
    assert truth.element(50.0, 0.0) == -1
    assert truth.label(50.0, 0.0) == Steppability.UNKNOWN


def test_pit_is_no_ground_to_walk_on():
    terrain = stepping_stones()
    truth = GroundTruth(terrain)
    assert truth.height(0.1, 0.0) == pytest.approx(-1.0)
    assert truth.label(0.1, 0.0) == Steppability.NON_PASSABLE
    assert np.isnan(truth.height(0.1, 0.0, walkable_only=True))
    assert truth.nearest_walkable_height(0.1, 0.0) == pytest.approx(0.0)
    pit = [i for i, element in enumerate(terrain.elements) if not element.is_walkable]
    assert [terrain.elements[i].name for i in pit] == ["pit_floor"]


def test_nearest_walkable_height_is_that_of_the_nearest_step():
    truth = GroundTruth(stairs())
    assert truth.nearest_walkable_height(0.4, 0.0) == pytest.approx(0.15)
    # Beside the platform's end the ground below is walkable too.
    assert truth.nearest_walkable_height(5.5, 0.0) == pytest.approx(0.0)
    stones = GroundTruth(stepping_stones(rise=0.2))
    low, high = stones.height(0.35, np.array([0.2, 0.6]))
    assert {round(float(low), 6), round(float(high), 6)} == {0.0, 0.2}
    assert stones.nearest_walkable_height(0.35, 0.39) == pytest.approx(low)


@pytest.mark.parametrize("name", ["flat", "ramp_10", "sparse_stones", "stairs", "stepping_stones"])
def test_library_surfaces_have_exact_patches(name):
    terrain = load_terrain(name)
    truth = GroundTruth(terrain)
    for patch in truth.patches:
        point = patch.polygon.representative_point()
        assert truth.height(point.x, point.y) == pytest.approx(patch.height(point.x, point.y), abs=1e-6)
        np.testing.assert_allclose(truth.normal(point.x, point.y), patch.normal, atol=1e-9)
        np.testing.assert_allclose(patch.frame()[:3, 2], patch.normal, atol=1e-12)
        assert patch.in_plane().area == pytest.approx(patch.polygon.area / patch.normal[2], rel=1e-6)
