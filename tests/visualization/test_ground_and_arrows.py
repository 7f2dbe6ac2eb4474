"""What makes ground readable, and the arrows of walks."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.diagrams.quadpips import QuadpipsConfig, QuadpipsDiagram
from quadpips_drake.diagrams.walk import WalkDiagram
from quadpips_drake.faults.push_system import Push
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.terrain.element_colors import COLORS, element_colors
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.visualization.meshcat_layers import draw_course
from quadpips_drake.visualization.meshes.arrows import command_mesh, push_mesh
from quadpips_drake.visualization.meshes.ground_meshes import checkered_mesh, edge_mesh
from quadpips_drake.visualization.push_visualizer_system import PushVisualizer
from quadpips_drake.visualization.recording import make_quiet_meshcat
from quadpips_drake.visualization.walk_visualizer_system import WalkVisualizer


def test_steps_and_stones_stand_out_from_the_ground():
    for name in ("stairs", "stepping_stones"):
        terrain = load_terrain(name)
        colors = dict(zip([element.name for element in terrain.elements], element_colors(terrain), strict=True))
        neighbours = ("tread_3", "tread_4") if name == "stairs" else ("stone_0_1", "start_platform")
        a, b = (np.array(colors[element]) for element in neighbours)
        assert np.abs(a - b).max() > 0.03, name
    pit = next(color for element, color in colors.items() if not element.startswith(("stone", "start", "goal")))
    assert pit == COLORS[3], "what no foot may use keeps the colour of its label"


def test_edges_lie_on_the_borders_of_upper_faces():
    terrain = load_terrain("stepping_stones")
    mesh = edge_mesh(terrain)
    assert len(mesh.vertices) == 8 * len(terrain.elements)
    tops = {round(element.bounds()[1][2], 6) for element in terrain.elements}
    assert {round(z - 0.001, 6) for z in mesh.vertices[:, 2]} == tops
    assert not edge_mesh(replace(terrain, elements=terrain.elements * 30)), "no dark net"


def test_every_second_square_of_a_floor_is_dark():
    mesh = checkered_mesh(load_terrain("flat"))
    corners = mesh.vertices[mesh.faces]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.abs(np.cross(a, b)).sum()
    assert area == pytest.approx(0.5 * 16.0**2, rel=0.02)
    assert (np.cross(a, b)[:, 2] > 0).all(), "seen from above"
    assert np.ptp(mesh.vertices[:, 0]) == pytest.approx(16.0)


def test_arrows_are_as_long_as_what_they_stand_for():
    forward = command_mesh(np.array([0.5, 0.0, 0.0]))
    assert forward.vertices[:, 0].max() == pytest.approx(0.5)
    assert not command_mesh(np.zeros(3))
    left, right = (command_mesh(np.array([0.0, 0.0, turn])).vertices[:, 1] for turn in (0.5, -0.5))
    assert left.max() > 0.2 and right.min() < -0.2
    push = push_mesh(np.array([0.0, 300.0, 0.0])).vertices
    assert push[:, 1].max() == pytest.approx(0.0), "it ends where it acts"
    assert push[:, 1].min() < -0.5


def test_a_walk_has_arrows_and_a_floor_but_no_goal():
    robot, meshcat = load_robot("go2"), make_quiet_meshcat()
    system = WalkVisualizer(robot, meshcat)
    draw_course(meshcat, load_terrain("flat"), has_goal=False)
    there = {path: meshcat.HasPath(f"/quadpips/{path}") for path in ("ground/floor", "course/start", "course/goal")}
    assert there == {"ground/floor": True, "course/start": True, "course/goal": False}
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(standing_state(robot)))
    for step in range(20):
        velocity = [0.3, 0.0, 0.0] if step < 10 else [0.3, 0.0, 0.004 * (step % 2)]
        system.GetInputPort("velocity_command").FixValue(context, velocity)
        simulator.AdvanceTo(0.05 * (step + 1))
    assert meshcat.HasPath("/quadpips/command/1")
    assert not meshcat.HasPath("/quadpips/command/2"), "what hardly changes is not drawn anew"


PUSHES = [Push(force=[0.0, 50.0, 0.0], time=0.2, duration=0.1)]


def test_a_push_is_an_arrow_while_it_acts():
    robot = load_robot("go2")
    arrows = PushVisualizer(robot, make_quiet_meshcat(), PUSHES)
    simulator = Simulator(arrows)
    context = simulator.get_mutable_context()
    arrows.get_input_port().FixValue(context, AbstractValue.Make(standing_state(robot)))
    pushing = []
    for step in range(12):
        simulator.AdvanceTo(0.05 * (step + 1))
        pushing.append(bool(context.get_abstract_state(0).get_value().pushing))
    assert [k for k, acts in enumerate(pushing) if acts] == [4, 5, 6, 7, 8], "0.2 s to 0.45 s"


def test_a_run_has_the_arrows_of_its_pushes_as_a_walk_has():
    robot, terrain = load_robot("go2"), load_terrain("flat")
    for make in (
        partial(QuadpipsDiagram, config=QuadpipsConfig(region_source="oracle")),
        partial(WalkDiagram, commands=[WalkCommand(0.0, "stance")]),
    ):
        meshcat = make_quiet_meshcat()
        make(robot, terrain, pushes=PUSHES, meshcat=meshcat)
        assert meshcat.HasPath("/quadpips/pushes/0")
