"""The planning systems through their contexts."""

import subprocess
import sys

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_planner_system import FootholdPlanner
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_planner_system import TorsoPlanner
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.plans import PlanRequest
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.steppability import Steppability
from tests.planning import worlds
from tests.planning.label_images import from_above

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


def test_the_newest_label_image_moves_the_feet():
    config = FootholdConfig(steppability="penalty")
    system = FootholdPlanner(ROBOT, config)
    floor, state = worlds.flat_ground(), worlds.standing_state(ROBOT)
    path = search_torso_path(state.p_WB, 0.0, floor, GOAL, ROBOT, TorsoConfig(), request_id=1, every_label=True)
    thorns = from_above(
        lambda x, y: np.where((x > 0.5) & ((x % 0.4) < 0.2), Steppability.NON_PASSABLE, Steppability.STEPPABLE)
    )

    def footholds(image):
        simulator = Simulator(system)
        context = simulator.get_mutable_context()
        fix(system, context, robot_state=state, torso_path=path, **({} if image is None else {"label_image": image}))
        simulator.AdvanceTo(0.1)
        plan = system.GetOutputPort("foothold_plan").Eval(context)
        return np.array([stance.footholds for stance in plan.stances])[1:]

    alone, empty, seen = (footholds(image) for image in (None, LabelImage.empty(), thorns))
    np.testing.assert_array_equal(alone, empty)
    hit = [((places[..., 0] > 0.5) & (places[..., 0] % 0.4 < 0.2)).sum() for places in (alone, seen)]
    assert hit[0] > 0 and hit[1] == 0


def test_without_the_penalty_there_is_no_port_for_labels():
    for word, there in (("exclude", False), ("off", False), ("penalty", True)):
        assert FootholdPlanner(ROBOT, FootholdConfig(steppability=word)).HasInputPort("label_image") == there


FIRST_PLAN = """
from dataclasses import replace
import numpy as np
from quadpips_drake import compiling
from quadpips_drake.planning.footholds.foothold_planner_system import FootholdPlanner, search_footholds
from quadpips_drake.planning.torso.torso_planner_system import TorsoPlanner, search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from tests.planning import worlds
from tests.planning.label_images import from_above

def loaded():
    return {kernel.py_func.__qualname__: len(kernel.overloads) for kernel in compiling._kernels()}

robot = load_robot("anymal_c")
torso, feet = TorsoPlanner(robot), FootholdPlanner(robot)
before, regions, state = loaded(), worlds.stepping_stones(), worlds.standing_state(robot)
path = search_torso_path(state.p_WB, 0.0, regions, np.array([3.5, 0.0]), robot, torso.config)
assert search_footholds(state, regions, path, robot, feet.config).success
weighing, image = replace(feet.config, steppability="penalty"), from_above(lambda x, y: 1)
assert search_footholds(state, regions, path, robot, weighing, labels=image).success
late = {name for name, number in loaded().items() if number > before.get(name, 0)}
assert not late, late
"""


def test_no_compiled_code_is_loaded_only_for_the_first_plan():
    done = subprocess.run([sys.executable, "-c", FIRST_PLAN], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
