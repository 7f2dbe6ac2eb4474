"""A reference that is dropped in mid-stride: the feet in the air come down at once, and the robot stands."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.control.contact_logic import FootMode
from quadpips_drake.control.safety import SafetyConfig, fall_reason
from quadpips_drake.control.walk_command import WalkCommand
from quadpips_drake.diagrams.walk import Walk
from quadpips_drake.robots.robot_model import load_robot
from quadpips_drake.terrain.library import load_terrain


def walking(name, time, speed=0.4):
    """A robot that trots on flat ground, ``time`` [s] after it was put down."""
    walk = Walk(load_robot(name), load_terrain("flat"), [WalkCommand(0.1, "trot", [speed, 0.0, 0.0])])
    simulator = Simulator(walk)
    context = simulator.get_mutable_context()
    walk.set_initial_state(context, [0.0, 0.0, 0.0])
    simulator.AdvanceTo(time)
    return walk, simulator, context


@pytest.mark.slow
@pytest.mark.parametrize("name", ["anymal_c", "go2"])
@pytest.mark.parametrize("time", [1.65, 1.8])
def test_an_abort_in_mid_stride_ends_in_standing(name, time):
    walk, simulator, context = walking(name, time)
    before = walk.observe(context)
    assert np.count_nonzero(before.foot_modes == FootMode.SWING) == 2
    assert before.robot_state.v_WB[0] > 0.2
    tracking = walk.tracking.GetMyMutableContextFromRoot(context)
    walk.tracking.GetInputPort("abort").FixValue(tracking, AbstractValue.Make(True))
    simulator.AdvanceTo(time + 0.03)
    assert np.count_nonzero(walk.observe(context).foot_modes == FootMode.SEARCH) >= 1
    largest_tilt = 0.0
    for moment in np.arange(time + 0.05, time + 1.0, 0.05):
        simulator.AdvanceTo(moment)
        state = walk.observe(context).robot_state
        largest_tilt = max(largest_tilt, np.abs(state.rpy_WB[:2]).max())
        assert fall_reason(state, walk.robot, SafetyConfig()) == ""
    assert largest_tilt < 0.15
    assert state.contacts.all() and np.linalg.norm(state.v_WB) < 0.1
    assert np.all(walk.observe(context).foot_modes == FootMode.STANCE)
