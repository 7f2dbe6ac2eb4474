"""The replan monitor through its context."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.supervision.replan_monitor_system import ReplanMonitor
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.plans import FootholdPlan
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.status import SafetyStatus, StageStatus
from tests.planning import worlds

ROBOT = load_robot("anymal_c")
GOAL = np.array([2.0, 0.0])


def fix(diagram, context, **values):
    for name, value in values.items():
        diagram.GetInputPort(name).FixValue(context, AbstractValue.Make(value))


def reference(request_id, end_time, x=1.0):
    """A reference that ends at ``end_time`` with the base at ``x``."""
    states = np.zeros((2, 24))
    states[-1, CentroidalState.POSITION] = [x, 0.0, ROBOT.nominal_base_height]
    times = np.array([end_time - 1.0, end_time])
    return WholeBodyReference(0.0, request_id, times, states, np.zeros((2, 24)), ContactSchedule.standing())


@pytest.mark.parametrize("with_status", [False, True])
def test_monitor_asks_walks_and_aborts(with_status):
    builder = DiagramBuilder()
    monitor = builder.AddSystem(ReplanMonitor(ROBOT))
    for name in ("robot_state", "goal", "reference", "foothold_plan", "safety_status"):
        builder.ExportInput(monitor.GetInputPort(name), name)
    if with_status:
        source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(StageStatus(0.0, 0, True))))
        builder.Connect(source.get_output_port(), monitor.GetInputPort("trajectory_status"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    root = simulator.get_mutable_context()
    context = monitor.GetMyContextFromRoot(root)
    read = lambda name: monitor.GetOutputPort(name).Eval(context)  # noqa: E731
    nothing, plan = reference(0, 0.0), FootholdPlan.empty()
    diagram.GetInputPort("goal").FixValue(root, GOAL)
    fix(diagram, root, robot_state=worlds.standing_state(ROBOT), reference=nothing, foothold_plan=plan)
    assert read("plan_request").id == 0 and read("status").phase == "standing_up" and read("abort") is False
    simulator.AdvanceTo(0.75)
    assert read("plan_request").id == 1 and read("status").phase == "planning"
    np.testing.assert_array_equal(read("plan_request").goal, GOAL)
    fix(diagram, root, reference=reference(1, 3.0))
    simulator.AdvanceTo(1.05)
    assert read("status").phase == "walking" and read("status").distance_to_goal == pytest.approx(2.0)
    fix(diagram, root, safety_status=SafetyStatus(1.1, True, "attitude", "the base tilts by 0.6 rad"))
    simulator.AdvanceTo(1.25)
    assert read("abort") is True and read("status").fallbacks["aborted_references"] == 1 and "tilts" in read("status").reason


def test_the_goal_may_move_until_a_plan_is_asked_for():
    monitor = ReplanMonitor(ROBOT)
    simulator = Simulator(monitor)
    context = simulator.get_mutable_context()
    monitor.GetInputPort("goal").FixValue(context, GOAL)
    plan = FootholdPlan.empty()
    fix(monitor, context, robot_state=worlds.standing_state(ROBOT), reference=reference(0, 0.0), foothold_plan=plan)
    simulator.AdvanceTo(0.3)
    monitor.GetInputPort("goal").FixValue(context, [3.0, 1.0])
    simulator.AdvanceTo(0.75)
    np.testing.assert_array_equal(monitor.GetOutputPort("plan_request").Eval(context).goal, [3.0, 1.0])
