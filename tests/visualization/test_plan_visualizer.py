"""The layers in Meshcat and the recording."""

import re
import shutil
import subprocess
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.ports import declare_output
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.plant_builder import add_terrain_visuals
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.visualization import recording
from quadpips_drake.visualization.camera_follower_system import CameraFollower
from quadpips_drake.visualization.colors import REGION_COLORS
from quadpips_drake.visualization.meshcat_layers import draw_course
from quadpips_drake.visualization.meshes import plan_meshes
from quadpips_drake.visualization.overlay.story import Story
from quadpips_drake.visualization.plan_visualizer_system import PlanVisualizer, PlanVisualizerConfig
from quadpips_drake.visualization.shapes import ColorMesh
from tests.visualization import examples

BROWSER_FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--window-size=640,360",
    "--virtual-time-budget=2000",
]


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


@pytest.fixture(scope="module")
def meshcat():
    return recording.make_quiet_meshcat()


def fix(system, context, name, value):
    system.GetInputPort(name).FixValue(context, AbstractValue.Make(value))


def visible_layers(meshcat, layer, count):
    return [i for i in range(1, count + 1) if meshcat.HasPath(f"/quadpips/{layer}/{i}")]


@pytest.mark.parametrize("keep_history", [True, False])
def test_each_plan_gets_objects_of_its_own(robot, meshcat, keep_history):
    meshcat.Delete("/quadpips")
    system = PlanVisualizer(robot, meshcat, PlanVisualizerConfig(keep_history=keep_history))
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    simulator.AdvanceTo(0.1)
    assert not meshcat.HasPath("/quadpips/footholds"), "nothing is connected, nothing is drawn"
    for number in (1, 2, 3):
        begin = context.get_time()
        fix(system, context, "reference", examples.reference(robot, number, begin))
        fix(system, context, "plan", examples.plan_sketch(robot, number))
        fix(system, context, "region_set", examples.regions(begin))
        simulator.AdvanceTo(begin + 0.5)
    shown = [1, 2, 3] if keep_history else [3]
    for layer in ("footholds", "swings", "base_reference", "regions", "stances"):
        assert visible_layers(meshcat, layer, 9) == shown, layer


def test_regions_are_redrawn_at_their_own_pace(robot, meshcat):
    meshcat.Delete("/quadpips")
    system = PlanVisualizer(robot, meshcat, PlanVisualizerConfig(region_period=0.5))
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    for step in range(40):
        fix(system, context, "region_set", examples.regions(0.05 * step))
        simulator.AdvanceTo(0.05 * (step + 1))
    assert visible_layers(meshcat, "regions", 99) == [1, 2, 3, 4]


def test_regions_are_not_computed_only_to_be_looked_at(robot, meshcat):
    """Reading them makes the region extractor compute them."""
    computed = []
    source = LeafSystem()

    def regions(context):
        computed.append(context.get_time())
        return examples.regions(context.get_time())

    declare_output(source, "region_set", RegionSet, regions)
    builder = DiagramBuilder()
    builder.AddSystem(source)
    system = builder.AddSystem(PlanVisualizer(robot, meshcat, PlanVisualizerConfig(region_period=0.5)))
    builder.Connect(source.get_output_port(), system.GetInputPort("region_set"))
    Simulator(builder.Build()).AdvanceTo(1.9)
    assert computed == [0.0, 0.5, 1.0, 1.5]


def test_labels_are_drawn_green_yellow_and_red_where_the_camera_sees_them(robot, meshcat):
    image = examples.affordance_image(0.0)
    points = plan_meshes.label_points(image, stride=2)
    # A camera 1 m above the ground that looks straight down sees its three stripes at z = 0, a hair nearer to the camera.
    np.testing.assert_allclose(points.positions[:, 2], plan_meshes.LIFT, atol=1e-3)
    x = points.positions[:, 0]
    for label, stripe in ((1, x < -0.02), (2, (x > -0.02) & (x < 0.23)), (3, x > 0.23)):
        assert stripe.any()
        np.testing.assert_allclose(points.colors[stripe], [REGION_COLORS[label]] * stripe.sum())
    assert len(points.positions) == (image.labels[1::2, 1::2] > 0).sum()

    meshcat.Delete("/quadpips")
    system = PlanVisualizer(robot, meshcat, PlanVisualizerConfig(label_period=0.5, label_stride=2))
    simulator = Simulator(system)
    for step in range(40):
        fix(system, simulator.get_mutable_context(), "affordance_image", examples.affordance_image(0.05 * step))
        simulator.AdvanceTo(0.05 * (step + 1))
    assert visible_layers(meshcat, "labels", 99) == [1, 2, 3, 4]


def test_images_without_labels_are_not_drawn(robot, meshcat):
    meshcat.Delete("/quadpips")
    system = PlanVisualizer(robot, meshcat)
    simulator = Simulator(system)
    image = examples.affordance_image(0.0)
    unlabelled = replace(image, labels=np.zeros_like(image.labels))
    fix(system, simulator.get_mutable_context(), "affordance_image", unlabelled)
    simulator.AdvanceTo(0.1)
    assert not meshcat.HasPath("/quadpips/labels")


def test_empty_and_failed_values_are_not_drawn(robot, meshcat):
    meshcat.Delete("/quadpips")
    system = PlanVisualizer(robot, meshcat)
    context = system.CreateDefaultContext()
    for port in ("region_set", "reference", "plan", "affordance_image"):
        model = system.AllocateInputAbstract(system.GetInputPort(port))
        system.GetInputPort(port).FixValue(context, model)
    simulator = Simulator(system, context)
    simulator.AdvanceTo(0.1)
    assert not meshcat.HasPath("/quadpips")


def test_config_is_checked():
    with pytest.raises(UserInputError, match="period"):
        PlanVisualizerConfig(period=0.0)
    with pytest.raises(UserInputError, match="label_stride"):
        PlanVisualizerConfig(label_stride=0)


def test_meshes_lie_where_the_values_are(robot):
    reference = examples.reference(robot, 1, 2.0)
    balls = plan_meshes.foothold_mesh(reference, ball_radius=0.02).vertices
    for target in reference.footholds:
        assert np.linalg.norm(balls - target.position, axis=1).min() == pytest.approx(0.02, abs=1e-9)
    paths = plan_meshes.swing_paths(reference, robot)
    assert [leg.name for leg, _ in paths] == ["LF", "RH"]
    for leg, path in paths:
        start = robot.nominal_footholds_B[leg] + [0.02, 0, robot.nominal_base_height]
        np.testing.assert_allclose(path[0], start, atol=1e-9)
    region_mesh = plan_meshes.region_mesh(examples.regions(0.0))
    assert region_mesh.faces.max() == len(region_mesh.vertices) - 1
    assert np.abs(region_mesh.vertices[:, 2] - plan_meshes.LIFT).max() < 1e-3
    assert not ColorMesh()


def test_tube_and_ball_are_closed_and_round():
    mesh = ColorMesh()
    line = np.array([[0.0, 0, 0], [0.5, 0, 0.2], [1, 0, 0]])
    mesh.add_tube(line, 0.1, (1, 0, 0), sides=8)
    distance = np.linalg.norm(mesh.vertices.reshape(3, 8, 3) - line[:, None], axis=-1)
    np.testing.assert_allclose(distance, 0.1, atol=1e-12)
    ball = ColorMesh()
    ball.add_ball([1, 2, 3], 0.5, (0, 1, 0))
    np.testing.assert_allclose(np.linalg.norm(ball.vertices - [1, 2, 3], axis=1), 0.5, atol=1e-12)
    assert ball.colors.shape == ball.vertices.shape


def record(robot, meshcat, path):
    """Records half a second of a robot that floats ahead, with two plans."""
    terrain = load_terrain("stepping_stones")
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    add_terrain_visuals(terrain, plant)
    robot.add_to_plant(plant)
    plant.Finalize()
    meshcat.Delete()
    recording.add_scene_visualizer(builder, scene_graph, meshcat)
    visualizer = builder.AddSystem(PlanVisualizer(robot, meshcat))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    plant.get_actuation_input_port().FixValue(plant_context, np.zeros(12))
    robot.set_state(plant, plant_context, [-1, 0, 1.5], [0, 0, 0], robot.nominal_joints)
    draw_course(meshcat, terrain)
    recording.start_recording(meshcat)
    for number in (1, 2):
        own = visualizer.GetMyContextFromRoot(context)
        fix(visualizer, own, "reference", examples.reference(robot, number, context.get_time()))
        fix(visualizer, own, "region_set", examples.regions(context.get_time()))
        simulator.AdvanceTo(context.get_time() + 0.25)
    return recording.save_recording(meshcat, path, Story(title="a test"))


def test_recording_holds_motion_and_plans(robot, meshcat, tmp_path):
    size = record(robot, meshcat, tmp_path / "recording.html")
    html = (tmp_path / "recording.html").read_text()
    assert len(html) == size
    assert 500_000 < size < 6_000_000
    assert "<title>a test</title>" in html
    assert not re.search(r"<(script|link)[^>]+(src|href)=.http", html), "nothing is fetched when it is opened"
    animation = meshcat.get_mutable_recording()
    assert animation.autoplay()
    assert animation.frames_per_second() == recording.FRAMES_PER_SECOND
    for path in ("/quadpips/course/goal", "/quadpips/footholds/2", "/quadpips/swings/1", "/quadpips/regions/2"):
        assert meshcat.HasPath(path)
    with pytest.raises(UserInputError, match="cannot write"):
        recording.save_recording(meshcat, tmp_path / "missing" / "recording.html")


@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs Debian's chromium")
def test_recording_opens_in_a_browser(robot, meshcat, tmp_path):
    import cv2

    record(robot, meshcat, tmp_path / "recording.html")
    command = ["chromium", *BROWSER_FLAGS]
    command += [f"--user-data-dir={tmp_path}/profile", f"--screenshot={tmp_path}/shot.png"]
    subprocess.run([*command, f"file://{tmp_path}/recording.html"], check=True, capture_output=True, timeout=60)
    picture = cv2.imread(str(tmp_path / "shot.png"))
    assert len(np.unique(picture[40:].reshape(-1, 3), axis=0)) > 500, "the scene was drawn"


def test_the_camera_follows_in_leaps():
    robot, meshcat = load_robot("go2"), Mock()
    system = CameraFollower(robot, meshcat, leap=1.0)
    context = system.CreateDefaultContext()
    for x, looks in ((0.0, 1), (0.9, 1), (1.1, 2), (1.2, 2)):
        state = replace(standing_state(robot), p_WB=np.array([x, 0.0, 0.3]))
        system.get_input_port().FixValue(context, AbstractValue.Make(state))
        found = system.EvalUniquePeriodicDiscreteUpdate(context)
        context.SetDiscreteState(found.get_vector().value())
        assert meshcat.SetCameraPose.call_count == looks
    assert meshcat.SetCameraPose.call_args.args[1][0] == 1.1
