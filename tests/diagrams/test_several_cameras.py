"""ANYmal C's four cameras into one egocan."""

import dataclasses

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from quadpips_drake.diagrams.observed_station import ObservedStation
from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.diagrams.simulation_station import StationConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import EgocanConfig, begin_memory, update_memory
from quadpips_drake.perception.egocan.ground_memory import GroundMemoryConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.sensing.depth_camera import DepthCameraConfig
from quadpips_drake.sensing.depth_noise import DepthNoiseConfig
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.images import AffordanceImage
from tests.perception.scenes import FEET, MEDIUM, Scene, affordance, base_pose

ALL_AROUND = ["left", "right", "rear"]
NOTHING_ASSUMED = GroundMemoryConfig(assumed_behind=0.0, assumed_ahead=0.0, assumed_half_width=0.0)
CONFIG = PerceptionConfig(egocan=EgocanConfig(ground=NOTHING_ASSUMED))


def look_around(further_cameras, terrain, noise=None):
    """Returns egocan and regions of a robot that stands at the start and has looked twice."""
    config = dataclasses.replace(CONFIG, depth_noise=noise or DepthNoiseConfig())
    station_config = StationConfig(camera=DepthCameraConfig(width=320, height=240), further_cameras=further_cameras)
    builder = DiagramBuilder()
    station = builder.AddSystem(ObservedStation(load_robot("anymal_c"), terrain, station_config))
    perception = builder.AddSystem(
        PerceptionModule(station.robot, station.camera_intrinsics, config, further_cameras=further_cameras)
    )
    for name in ("depth_image", "robot_state", *(f"depth_image_{camera}" for camera in further_cameras)):
        builder.Connect(station.GetOutputPort(name), perception.GetInputPort(name))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    station.set_initial_state(context, *terrain.start)
    simulator = Simulator(diagram, context)
    simulator.Initialize()
    simulator.AdvanceTo(0.06)
    mine = perception.GetMyContextFromRoot(context)
    return [perception.GetOutputPort(name).Eval(mine) for name in ("egocan", "region_set")], perception


def sides_with_regions(regions, start):
    """Returns in which quarters around ``start`` (ahead, left, behind, right) regions lie, 0.4 to 1.2 m away."""
    offsets = np.array([region.center[:2] - start[:2] for region in regions.regions]).reshape(-1, 2)
    offsets = offsets[(np.hypot(*offsets.T) > 0.4) & (np.hypot(*offsets.T) < 1.6)]
    quarter = np.rint((np.arctan2(offsets[:, 1], offsets[:, 0]) - start[2]) / (np.pi / 2)).astype(int) % 4
    return set(quarter.tolist())


@pytest.mark.parametrize("noise", [None, DepthNoiseConfig(0.001, 0.004, 0.02)])
def test_four_cameras_see_all_around(noise):
    terrain = load_terrain("stepping_stones")
    (can, regions), perception = look_around(ALL_AROUND, terrain, noise)
    assert sides_with_regions(regions, terrain.start) == {0, 1, 2, 3}
    corners = np.concatenate([region.inset @ region.X_WR[:3, :2].T + region.center for region in regions.regions])
    truth = GroundTruth(terrain)
    np.testing.assert_allclose(corners[:, 2], truth.height(corners[:, 0], corners[:, 1]), atol=0.01)
    assert truth.distance_to_edge(corners[:, 0], corners[:, 1]).min() > 0.02
    assert perception.GetInputPort("labels_rear").get_name() == "labels_rear"
    if noise is None:
        (front, only_ahead), _ = look_around([], terrain)
        assert sides_with_regions(only_ahead, terrain.start) <= {0, 1, 3}
        np.testing.assert_array_equal(front.X_WE, can.X_WE)
        assert np.isfinite(can.cylinder_range).any(axis=0).mean() >= np.isfinite(front.cylinder_range).any(axis=0).mean()


def test_one_dead_camera_does_not_blind_the_others():
    X_WB, mounts = base_pose(), load_robot("anymal_c").camera_mounts
    eyes = [X_WB @ mount.X_BC for mount in mounts]
    scene, config = Scene([]), CONFIG.egocan
    images = [affordance(scene.depth(X_WC, MEDIUM), X_WC, 0.0, CONFIG, MEDIUM) for X_WC in eyes]
    dead = dataclasses.replace(AffordanceImage.empty(), stamp=0.0, X_WC=eyes[0])
    whole = begin_memory(images, 0.0, X_WB, FEET, config)
    blind = begin_memory([dead, *images[1:]], 0.0, X_WB, FEET, config)
    np.testing.assert_array_equal(blind.X_WE, whole.X_WE)
    known = [np.isfinite(memory.ground.height).mean() for memory in (whole, blind)]
    assert 0.5 * known[0] < known[1] < known[0]
    assert update_memory(whole, [AffordanceImage.empty(), *images[1:]], 0.0, config) is whole, "nobody knows the pose"


@pytest.mark.parametrize("names", [["front"], ["left", "left"]])
def test_every_camera_is_named_once(names):
    with pytest.raises(UserInputError, match="each once"):
        StationConfig(further_cameras=names)
    with pytest.raises(UserInputError, match="unknown camera"):
        look_around(["above"], load_terrain("flat"))
