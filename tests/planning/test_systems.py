"""The planning systems through their contexts."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource

from quadpips_drake.planning.footholds.foothold_planner_system import FootholdPlanner
from quadpips_drake.planning.torso.torso_planner_system import TorsoPlanner
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.supervision.replan_monitor_system import ReplanMonitor
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.plans import FootholdPlan, PlanRequest
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.status import SafetyStatus, StageStatus
from tests.planning import worlds

ROBOT = load_robot("anymal_c")
GOAL = np.array([2.0, 0.0])


def planners():
    """The two planners in a row, their inputs exported."""
    builder, timings = DiagramBuilder(), StageTimings()
    torso = builder.AddSystem(TorsoPlanner(ROBOT, timings=timings))
    feet = builder.AddSystem(FootholdPlanner(ROBOT, timings=timings))
    builder.Connect(torso.GetOutputPort("torso_path"), feet.GetInputPort("torso_path"))
    builder.ExportInput(torso.GetInputPort("robot_state"), "robot_state")
    builder.ConnectInput("robot_state", feet.GetInputPort("robot_state"))
    for name in ("region_set", "plan_request"):
        builder.ExportInput(torso.GetInputPort(name), name)
    builder.ExportOutput(torso.GetOutputPort("torso_path"), "torso_path")
    builder.ExportOutput(feet.GetOutputPort("foothold_plan"), "foothold_plan")
    return builder.Build(), timings


def fix(diagram, context, **values):
    for name, value in values.items():
        diagram.GetInputPort(name).FixValue(context, AbstractValue.Make(value))


def test_plans_once_for_each_request():
    diagram, timings = planners()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    regions = worlds.flat_ground()
    fix(
        diagram,
        context,
        robot_state=worlds.standing_state(ROBOT),
        region_set=regions,
        plan_request=PlanRequest(0, 0.0, GOAL),
    )
    simulator.AdvanceTo(0.3)
    assert timings.summary_ms() == {}
    assert not diagram.GetOutputPort("foothold_plan").Eval(context).success
    fix(diagram, context, plan_request=PlanRequest(1, 0.3, GOAL))
    simulator.AdvanceTo(0.8)
    path, plan = (diagram.GetOutputPort(name).Eval(context) for name in ("torso_path", "foothold_plan"))
    assert path.request_id == plan.request_id == 1 and path.success and plan.success
    assert path.regions is regions  # all feet stand on perceived ground: nothing is assumed
    assert {name: entry["n"] for name, entry in timings.summary_ms().items()} == {"torso_search": 1, "foothold_search": 1}
    fix(diagram, context, plan_request=PlanRequest(2, 0.8, GOAL))
    simulator.AdvanceTo(1.2)
    assert diagram.GetOutputPort("foothold_plan").Eval(context).request_id == 2

    clone = context.Clone()  # the outputs depend on the context alone
    assert diagram.GetOutputPort("foothold_plan").Eval(clone) is diagram.GetOutputPort("foothold_plan").Eval(context)


def test_assumes_the_ground_under_the_robot_once_and_keeps_it():
    diagram, _ = planners()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    seen = worlds.flat_ground((0.7, 3.0))
    fix(diagram, context, robot_state=worlds.standing_state(ROBOT), region_set=seen, plan_request=PlanRequest(1, 0.0, GOAL))
    simulator.AdvanceTo(0.2)
    path = diagram.GetOutputPort("torso_path").Eval(context)
    ground = path.regions.regions[-1]
    assert len(path.regions.regions) == len(seen.regions) + 1 and ground.id < 0
    assert diagram.GetOutputPort("foothold_plan").Eval(context).success
    fix(diagram, context, robot_state=worlds.standing_state(ROBOT, x=0.4), plan_request=PlanRequest(2, 0.2, GOAL))
    simulator.AdvanceTo(0.5)
    assert diagram.GetOutputPort("torso_path").Eval(context).regions.regions[-1] is ground


def test_a_failed_torso_search_fails_the_foothold_plan_with_its_reason():
    diagram, _ = planners()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    floating = worlds.standing_state(ROBOT, z=5.0)
    fix(diagram, context, robot_state=floating, region_set=RegionSet(0.0), plan_request=PlanRequest(1, 0.0, [50.0, 0.0]))
    simulator.AdvanceTo(0.3)
    path, plan = (diagram.GetOutputPort(name).Eval(context) for name in ("torso_path", "foothold_plan"))
    assert not path.success and path.reason
    assert plan.request_id == 1 and plan.reason == path.reason


def reference(request_id, end_time, x=1.0):
    """A reference that ends at ``end_time`` with the base at ``x``."""
    states = np.zeros((2, 24))
    states[-1, CentroidalState.POSITION] = [x, 0.0, ROBOT.nominal_base_height]
    times = np.array([end_time - 1.0, end_time])
    return WholeBodyReference(0.0, request_id, times, states, np.zeros((2, 24)), ContactSchedule.standing())


@pytest.mark.parametrize("with_status", [False, True])
def test_monitor_asks_walks_and_aborts(with_status):
    builder = DiagramBuilder()
    monitor = builder.AddSystem(ReplanMonitor())
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
    plan = FootholdPlanner(ROBOT).GetOutputPort("foothold_plan").Allocate().get_value()
    nothing = reference(0, 0.0)
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
    monitor = ReplanMonitor()
    simulator = Simulator(monitor)
    context = simulator.get_mutable_context()
    monitor.GetInputPort("goal").FixValue(context, GOAL)
    plan = FootholdPlan.empty()
    fix(monitor, context, robot_state=worlds.standing_state(ROBOT), reference=reference(0, 0.0), foothold_plan=plan)
    simulator.AdvanceTo(0.3)
    monitor.GetInputPort("goal").FixValue(context, [3.0, 1.0])
    simulator.AdvanceTo(0.75)
    np.testing.assert_array_equal(monitor.GetOutputPort("plan_request").Eval(context).goal, [3.0, 1.0])
