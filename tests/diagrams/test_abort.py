"""Trouble in mid-stride: a dropped reference, a safety event, programs that fail; and the strict hierarchy in a walk."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.control.whole_body.whole_body_methods import MethodSolution, WeightedMethod
from quadpips_drake.diagrams.walk import WalkConfig, WalkDiagram
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.supervision.safety import SafetyConfig, fall_reason
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.observation import observe
from quadpips_drake.values.whole_body_command import FootMode

pytestmark = pytest.mark.slow


def walking(name, time, config=None):
    """A robot that trots on flat ground, ``time`` [s] after it was put down."""
    walk = WalkDiagram(load_robot(name), load_terrain("flat"), [WalkCommand(0.1, "trot", [0.4, 0.0, 0.0])], config)
    simulator = Simulator(walk)
    context = simulator.get_mutable_context()
    walk.set_initial_state(context, [0.0, 0.0, 0.0])
    simulator.AdvanceTo(time)
    return walk, simulator, context


@pytest.mark.parametrize(("name", "time"), [("anymal_c", 1.8), ("go2", 1.65)])
def test_an_abort_in_mid_stride_ends_in_standing(name, time):
    walk, simulator, context = walking(name, time)
    before = observe(walk, context)
    assert np.count_nonzero(before.command.foot_modes == FootMode.SWING) == 2
    assert before.robot_state.v_WB[0] > 0.2
    tracking = walk.tracking.GetMyMutableContextFromRoot(context)
    walk.tracking.GetInputPort("abort").FixValue(tracking, AbstractValue.Make(True))
    simulator.AdvanceTo(time + 0.03)
    assert np.count_nonzero(observe(walk, context).command.foot_modes == FootMode.SEARCH) >= 1
    largest_tilt = 0.0
    for moment in np.arange(time + 0.05, time + 1.0, 0.05):
        simulator.AdvanceTo(moment)
        state = observe(walk, context).robot_state
        largest_tilt = max(largest_tilt, np.abs(state.rpy_WB[:2]).max())
        assert fall_reason(state, walk.robot, SafetyConfig()) == ""
    assert largest_tilt < 0.15
    assert state.contacts.all() and np.linalg.norm(state.v_WB) < 0.1
    assert np.all(observe(walk, context).command.foot_modes == FootMode.STANCE)


def test_after_an_event_the_walk_begins_anew():
    config = WalkConfig()
    config.tracking.safety.max_slip = 0.004  # less than a foot creeps in a stance
    walk, simulator, context = walking("go2", 0.4, config)
    counts = {}
    while not counts and context.get_time() < 2.0:
        simulator.AdvanceTo(context.get_time() + 0.05)
        counts = observe(walk, context).fallbacks
        counts = {event: count for event, count in counts.items() if event.startswith("unstable")}
    assert counts == {"unstable_slip": 1}
    config.tracking.safety.max_slip = 0.1
    stopped = observe(walk, context).robot_state.p_WB[0]
    simulator.AdvanceTo(context.get_time() + 2.5)
    now = observe(walk, context)
    assert fall_reason(now.robot_state, walk.robot, SafetyConfig()) == ""
    assert now.robot_state.p_WB[0] > stopped + 0.1
    assert now.fallbacks["unstable_slip"] == 1


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_programs_that_fail_for_a_tenth_of_a_second_do_not_make_it_fall(name, monkeypatch):
    walk, simulator, context = walking(name, 1.8)
    failed = MethodSolution(False, False, "made to fail", 0, np.zeros(30))
    with monkeypatch.context() as patch:
        patch.setattr(WeightedMethod, "solve_matrices", lambda *args: failed)
        simulator.AdvanceTo(1.9)
    assert observe(walk, context).fallbacks["wbc"] == pytest.approx(50, abs=1)
    for moment in np.arange(1.95, 2.9, 0.05):
        simulator.AdvanceTo(moment)
        state = observe(walk, context).robot_state
        assert np.abs(state.rpy_WB[:2]).max() < 0.2
        assert fall_reason(state, walk.robot, SafetyConfig()) == ""
    assert observe(walk, context).fallbacks["wbc"] <= 51
    assert state.v_WB[0] > 0.2


def test_the_strict_hierarchy_walks():
    config = WalkConfig()
    config.tracking.wbc.method = "hierarchical"
    walk, _, context = walking("anymal_c", 1.8, config)
    now = observe(walk, context)
    assert now.fallbacks["wbc"] == 0
    assert np.abs(now.robot_state.rpy_WB[:2]).max() < 0.1
    assert now.robot_state.v_WB[0] > 0.2
