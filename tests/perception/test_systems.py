"""The perception as systems: on the station's rendered images, and on nonsense."""

import dataclasses

import numpy as np
import pytest
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.diagrams.observed_station import ObservedStation
from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.diagrams.simulation_station import StationConfig
from quadpips_drake.perception.normals.normal_estimator_system import NormalEstimator
from quadpips_drake.perception.regions.oracle_regions_system import OracleRegions
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.sensing.depth_camera import DepthCameraConfig
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.steppability import Steppability
from tests.perception.scenes import SMALL, Scene, base_pose, corners_in_world

STATION = StationConfig(camera=DepthCameraConfig(width=320, height=240))


def states_and_images(robot, frames, spoil=lambda k, depth: depth):
    """Yields RobotState and ImageDepth32F of a robot walking along x over an analytic floor."""
    for k in range(frames):
        X_WB = base_pose(x=0.02 * k, height=robot.nominal_base_height)
        state = dataclasses.replace(
            RobotState.empty(), stamp=k / 30.0, p_WB=X_WB[:3, 3], joint_positions=robot.nominal_joints
        )
        image = ImageDepth32F(SMALL.width, SMALL.height)
        image.mutable_data[:, :, 0] = spoil(k, Scene([]).depth(X_WB @ robot.camera().X_BC, SMALL))
        yield state, image


def run_module(robot, frames, spoil=lambda k, depth: depth):
    """Returns the region sets after each frame."""
    module = PerceptionModule(robot, SMALL)
    simulator = Simulator(module)
    context, results = simulator.get_mutable_context(), []
    for k, (state, image) in enumerate(states_and_images(robot, frames, spoil)):
        module.GetInputPort("depth_image").FixValue(context, Value(image))
        module.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
        if k == 0:
            simulator.Initialize()
        simulator.AdvanceTo((k + 1) / 30.0)
        results.append(module.GetOutputPort("region_set").Eval(context))
    return module, context, results


@pytest.mark.parametrize(("robot_name", "terrain_name"), [("anymal_c", "stepping_stones"), ("go2", "flat")])
def test_sees_ground_through_the_rendered_camera(robot_name, terrain_name):
    robot, terrain, timings = load_robot(robot_name), load_terrain(terrain_name), StageTimings()
    builder = DiagramBuilder()
    station = builder.AddSystem(ObservedStation(robot, terrain, STATION))
    module = builder.AddSystem(PerceptionModule(robot, station.camera_intrinsics, timings=timings))
    for name in ("depth_image", "robot_state"):
        builder.Connect(station.GetOutputPort(name), module.GetInputPort(name))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    station.set_initial_state(context, *terrain.start)
    simulator.Initialize()
    simulator.AdvanceTo(0.002)
    regions = module.GetOutputPort("region_set").Eval(module.GetMyContextFromRoot(context)).regions
    assert len(regions) > 35
    corners = np.concatenate([corners_in_world(region, region.inset) for region in regions])
    truth = GroundTruth(terrain)
    np.testing.assert_allclose(corners[:, 2], truth.height(corners[:, 0], corners[:, 1]), atol=3e-3)
    assert truth.distance_to_edge(corners[:, 0], corners[:, 1]).min() > robot.foot_radius
    # Ground all the way from behind the hind feet to what lies ahead in view, but for the gaps of the terrain.
    ahead = np.array([region.center[0] for region in regions]) - terrain.start[0]
    assert ahead.min() < robot.nominal_footholds_B[:, 0].min() - 0.1 and ahead.max() > 1.0
    assert np.diff(np.sort(ahead)).max() < 0.5
    assert {"normals", "egocan", "superpixels", "regions", "self_filter"} <= set(timings.summary_ms())


def test_nonsense_after_a_good_start_neither_raises_nor_invents_ground():
    robot = load_robot("anymal_c")
    rng = np.random.default_rng(0)
    nonsense = [np.nan, np.inf, 0.0, -1.0, 65.535]

    def spoil(k, depth):
        if k < 3:
            return depth
        return np.full_like(depth, nonsense[k - 3]) if k < 8 else rng.uniform(0, 4, depth.shape)

    _, _, results = run_module(robot, 12, spoil)
    assert len(results[2].regions) > 30
    for result in results:
        assert all(abs(region.center[2]) < 0.01 for region in result.regions)


def test_a_cloned_context_gives_the_same_answer_in_any_order():
    module, context, _ = run_module(load_robot("anymal_c"), 3)
    clone = context.Clone()
    names = ("region_set", "superpixels", "egocan", "affordance_image")
    first = [module.GetOutputPort(name).Eval(context) for name in names]
    second = [module.GetOutputPort(name).Eval(clone) for name in reversed(names)][::-1]
    assert len(first[0].regions) == len(second[0].regions) > 0
    for a, b in zip(first[0].regions, second[0].regions, strict=True):
        np.testing.assert_array_equal(a.X_WR, b.X_WR)
    np.testing.assert_array_equal(first[2].cap_height, second[2].cap_height)


def test_labels_are_optional_and_of_the_right_size():
    robot = load_robot("anymal_c")
    system = NormalEstimator(robot.camera().X_BC, SMALL)
    context = system.CreateDefaultContext()
    state, image = next(states_and_images(robot, 1))
    system.GetInputPort("depth_image").FixValue(context, Value(image))
    system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
    output = system.GetOutputPort("affordance_image")
    assert np.all(output.Eval(context).labels == Steppability.UNKNOWN)
    for shape, expected in (((SMALL.height, SMALL.width), Steppability.PASSABLE), ((3, 3), Steppability.UNKNOWN)):
        labels = LabelImage(0.0, np.full(shape, Steppability.PASSABLE, np.uint8))
        system.GetInputPort("labels").FixValue(context, AbstractValue.Make(labels))
        assert np.all(output.Eval(context).labels == expected)
    wrong = ImageDepth32F(20, 10)
    system.GetInputPort("depth_image").FixValue(context, Value(wrong))
    assert output.Eval(context).depth.size == 0


def test_oracle_and_perception_speak_the_same_port_type():
    robot = load_robot("anymal_c")
    system = OracleRegions(load_terrain("flat"), robot.foot_radius)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(RobotState.empty()))
    simulator.AdvanceTo(0.1)
    result = system.GetOutputPort("region_set").Eval(context)
    assert isinstance(result, RegionSet) and len(result.regions) > 0


def test_the_oracle_knows_heights_of_all_elements():
    terrain = load_terrain("stepping_stones")
    system = OracleRegions(terrain, 0.03)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    state = dataclasses.replace(RobotState.empty(), p_WB=np.array([0.3, 0.1, 0.6]))
    system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
    simulator.AdvanceTo(0.1)
    heights = system.GetOutputPort("ground_heights").Eval(context)
    assert np.abs(heights.corner + 1.5 - state.p_WB[:2]).max() <= heights.cell
    for i, j in ((0, 0), (75, 75), (149, 20), (100, 149)):
        x, y = heights.corner + heights.cell * (np.array([i, j]) + 0.5)
        assert heights.height[i, j] == pytest.approx(float(GroundTruth(terrain).height(x, y)), abs=1e-6)
    assert heights.height.min() < -0.5  # the floor of the pit
