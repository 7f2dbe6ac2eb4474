"""What cameras look at is the terrain, whatever was left out of it."""

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from quadpips_drake.robots.robot_description import CameraDescription, mount_camera
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, add_depth_camera
from quadpips_drake.terrain.camera_scene import LOWEST_CAMERA, add_terrain_to_camera_scene, is_hidden, lowest_ground
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.plant_builder import add_terrain_visual
from quadpips_drake.terrain.terrain import Box, Cylinder, Terrain, pose
from quadpips_drake.terrain.triangles import joined_triangles
from quadpips_drake.values.steppability import Steppability


def one_by_one(terrain, plant):
    for index, element in enumerate(terrain.elements):
        add_terrain_visual(index, element, plant)


def image(terrain, show, xyz, pitch) -> np.ndarray:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    show(terrain, plant)
    plant.Finalize()
    mount = mount_camera(CameraDescription(position=list(xyz), pitch=pitch))
    small = DepthCameraConfig(width=160, height=120)
    camera = add_depth_camera(builder, scene_graph, SceneGraph.world_frame_id(), mount, small)
    builder.Connect(scene_graph.get_query_output_port(), camera.query_object_input_port())
    diagram = builder.Build()
    context = camera.GetMyContextFromRoot(diagram.CreateDefaultContext())
    return camera.depth_image_32F_output_port().Eval(context).data[:, :, 0].copy()


def tunnel() -> Terrain:
    """A roof on two posts above the ground, which a robot could walk under."""
    floor = Box(size=(8, 8, 0.2), X_WE=pose((0, 0, -0.1)))
    roof = Box(size=(2, 2, 0.1), X_WE=pose((1.5, 0, 1.0)))
    posts = [Cylinder(radius=0.1, length=0.95, X_WE=pose((1.5, side, 0.475))) for side in (-0.9, 0.9)]
    return Terrain("tunnel", (0, 0, 0), (1, 0), 1.0, (floor, roof, *posts))


TERRAINS = {name: load_terrain(name) for name in ("stairs", "sparse_stones", "ramp_10")} | {"tunnel": tunnel()}


@pytest.mark.parametrize("name", TERRAINS)
@pytest.mark.parametrize(("height", "pitch"), [(0.3, 0.2), (0.6, 0.6), (0.4, -0.6)])
def test_images_are_those_of_the_elements(name, height, pitch):
    terrain = TERRAINS[name]
    where = (terrain.start[0], 0.1, height)
    expected, seen = (image(terrain, show, where, pitch) for show in (one_by_one, add_terrain_to_camera_scene))
    # At the silhouette of an element a ray just hits or just misses it.
    equal = np.isclose(seen, expected, rtol=0.0, atol=1e-4)
    assert equal.mean() > 0.999
    if name == "tunnel" and pitch < 0:
        assert np.isfinite(seen).mean() > 0.1, "the roof is seen from below"


def test_only_undersides_below_all_cameras_are_left_out():
    low, high = (Box(size=(1, 1, 0.2), X_WE=pose((0, 0, z))) for z in (LOWEST_CAMERA - 0.1, LOWEST_CAMERA + 0.3))
    for box, hidden in ((low, 2), (high, 0)):
        vertices, triangles = joined_triangles([box])
        found = is_hidden(vertices[triangles], 0.0)
        assert found.sum() == hidden
        assert (vertices[triangles][found][:, :, 2] <= LOWEST_CAMERA).all()


def test_a_pit_that_nobody_walks_in_does_not_count_as_ground():
    stone = Box(size=(1, 1, 0.1), X_WE=pose((0, 0, -0.05)))
    pit = Box(size=(9, 9, 0.1), X_WE=pose((0, 0, -1.0)), label=Steppability.NON_PASSABLE)
    assert lowest_ground((stone, pit)) == pytest.approx(0.0)
    assert lowest_ground((pit,)) == pytest.approx(-0.95)
