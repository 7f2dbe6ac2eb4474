"""The planner as a system, and its diagram: ports, no hidden state, the same answers whatever is asked first."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.baselines.motion_models.planner.motion_models_module import MotionModelsConfig, MotionModelsModule
from quadpips_drake.baselines.motion_models.planner.variants import belief_of
from quadpips_drake.baselines.motion_models.planner.velocity_planner_system import VelocityPlanner
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.ports import input_names
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.values.status import PlannerPhase
from tests.baselines.motion_models.planner.worlds import ground

OUTPUTS = ("velocity_command", "gait", "plan", "status", "velocity_plan", "report")


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def planner_in_step(robot):
    """A planner that has just begun a step, in its simulator: it was shown a robot that lifts two feet."""
    system = VelocityPlanner(robot, "trot", belief_of("ideal", robot, "trot", None, VelocityReferenceConfig(), None))
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("goal").FixValue(context, np.array([3.0, 0.0]))
    for time, down in ((0.0, [True] * 4), (0.1, [True, False, False, True]), (0.2, [True, False, False, True])):
        state = replace(standing_state(robot, time), contacts=np.array(down))
        system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
        world = replace(ground([(0.9, 1.0)]), stamp=time)
        system.GetInputPort("foot_costmap").FixValue(context, AbstractValue.Make(world))
        simulator.AdvanceTo(time + 0.01)
    return system, simulator


def _timeless(item):
    """Without computing times."""
    if isinstance(item, dict):
        return {key: value for key, value in item.items() if key != "search_ms"}
    return item


def values_of(system, context, order) -> dict:
    found = {}
    for name in order:
        value = system.GetOutputPort(name).Eval(context)
        found[name] = repr(
            {key: _timeless(item) for key, item in vars(value).items() if key != "elapsed"}
            if hasattr(value, "__dict__")
            else value
        )
    return found


def test_it_plans_when_feet_are_lifted(robot):
    system, simulator = planner_in_step(robot)
    context = simulator.get_context()
    plan, status = (system.GetOutputPort(name).Eval(context) for name in ("velocity_plan", "status"))
    assert plan.found and plan.swing == 1, "RF and LH are off the ground"
    assert status.phase == PlannerPhase.WALKING and status.distance_to_goal == pytest.approx(3.0, abs=0.05)
    command = system.GetOutputPort("velocity_command").Eval(context)
    np.testing.assert_array_equal(command[:2], plan.commands[0])
    assert system.GetOutputPort("gait").Eval(context) == "trot"
    sketch = system.GetOutputPort("plan").Eval(context)
    assert len(sketch.points) == len(sketch.legs) == 2 * len(plan.commands) and sketch.id == plan.id
    assert sketch.legs[:4].tolist() == [1, 2, 0, 3]
    np.testing.assert_array_equal(sketch.points[0], plan.feet[1, 1])
    assert system.timings.summary_ms()["command_search"]["n"] == 1


def test_order_of_evaluation_and_clones_change_nothing(robot):
    system, simulator = planner_in_step(robot)
    context = simulator.get_context()
    clone = context.Clone()
    forward = values_of(system, context, OUTPUTS)
    backward = values_of(system, clone, OUTPUTS[::-1])
    assert forward == backward
    _, again = planner_in_step(robot)
    assert values_of(system, context, OUTPUTS) == values_of(again.get_system(), again.get_context(), OUTPUTS)


def test_an_exact_map_needs_no_perception(robot):
    config = MotionModelsConfig(variant="kinematic")
    seen = MotionModelsModule(robot, config)
    exact = MotionModelsModule(robot, config, truth=load_terrain("gaps_symmetric"))
    assert "ground_heights" in input_names(seen) and "ground_heights" not in input_names(exact)
    context = exact.CreateDefaultContext()
    exact.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(standing_state(robot)))
    exact.GetInputPort("goal").FixValue(context, np.array([2.0, 0.0]))
    simulator = Simulator(exact, context)
    simulator.Initialize()
    assert exact.GetOutputPort("foot_costmap").Eval(simulator.get_context()).safe.any()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"variant": "perfect"}, "known: blind, ideal, kinematic, learned"),
        ({"gait": "static_walk"}, "diagonal pairs must swing in turn"),
        ({"gait": "hop"}, "unknown gait"),
    ],
)
def test_bad_settings_are_refused_with_one_line(settings, words):
    with pytest.raises(UserInputError, match=words) as caught:
        MotionModelsConfig(**settings)
    assert "\n" not in str(caught.value)


def test_missing_models_are_named(robot, tmp_path):
    with pytest.raises(UserInputError, match="motion models"):
        MotionModelsModule(robot, MotionModelsConfig(models=str(tmp_path / "nowhere")))
