"""What a recording shows of the planner: the costmap around the robot, and where feet came down."""

from dataclasses import replace

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.baselines.motion_models.planner.costmap_visualizer_system import CostmapVisualizer, costmap_points
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import REGION_COLORS
from quadpips_drake.visualization.recording import make_quiet_meshcat
from tests.baselines.motion_models.planner.worlds import ground


def test_points_are_coloured_by_clearance_and_unknown_ground_is_not_drawn():
    points = costmap_points(ground([(0.5, 0.7)]), np.zeros(2), 0.0)
    x, colors = points.positions[:, 0], np.asarray(points.colors)
    assert not ((x > 0.51) & (x < 0.69)).any() and np.abs(points.positions[:, :2]).max() <= 1.3
    far = (np.abs(x) < 0.2) & (np.abs(points.positions[:, 1]) < 0.2)
    np.testing.assert_allclose(colors[far], np.tile(REGION_COLORS[Steppability.STEPPABLE], (far.sum(), 1)))
    near = (x > 0.44) & (x < 0.5)
    assert (colors[near][:, 0] > colors[far][0, 0]).all(), "nearer to yellow"
    edge = costmap_points(ground(step=(0.5, 0.06)), np.zeros(2), 0.0)
    red = np.isclose(edge.colors, REGION_COLORS[Steppability.NON_PASSABLE]).all(axis=1)
    inner = red & (np.abs(edge.positions[:, 1]) < 0.7)
    assert inner.any() and np.abs(edge.positions[inner, 0] - 0.5).max() <= 0.02


def test_maps_and_marks_appear_in_meshcat():
    robot, meshcat = load_robot("anymal_c"), make_quiet_meshcat()
    system = CostmapVisualizer(robot, meshcat)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("foot_costmap").FixValue(context, AbstractValue.Make(ground()))
    for time, down in ((0.0, True), (0.1, False), (0.3, True), (1.2, True)):
        contacts = np.array([down, True, True, True])
        state = replace(standing_state(robot, time), contacts=contacts)
        system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
        simulator.AdvanceTo(time + 0.05)
    assert meshcat.HasPath("/quadpips/costmap/2") and not meshcat.HasPath("/quadpips/costmap/3")
    assert meshcat.HasPath("/quadpips/landed/1") and not meshcat.HasPath("/quadpips/landed/2")
