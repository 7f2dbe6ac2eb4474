"""Signs of a fall, and what the safety monitor makes of them."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage import _Remembered
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.supervision.safety import SafetyConfig, SafetyMemory, fall_reason, height_above_feet, watch
from quadpips_drake.supervision.safety_monitor_system import SafetyMonitor
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.status import SAFETY_EVENTS

ROBOT = load_robot("anymal_c")
REST = standing_state(ROBOT)


def _tilted(roll):
    rpy = np.array([roll, 0.0, 0.0])
    return replace(REST, rpy_WB=rpy, R_WB=rotation_from_rpy(rpy))


def _watch(state, seconds, memory=None, config=None):
    """The memory after looking at ``state`` for so long, a hundred times a second."""
    memory = memory or SafetyMemory.empty()
    start = max(memory.status.stamp, 0.0)
    for i in range(round(100 * seconds)):
        memory = watch(
            memory, replace(state, stamp=start + 0.01 * (i + 1)), MpcPolicy.empty(), ROBOT, config or SafetyConfig()
        )
    return memory


def test_a_standing_robot_is_safe():
    assert not _watch(REST, 1.0).status.unstable
    assert fall_reason(REST, ROBOT, SafetyConfig()) == ""
    assert height_above_feet(REST, ROBOT) == pytest.approx(ROBOT.nominal_base_height - ROBOT.foot_radius)


@pytest.mark.parametrize(
    ("state", "rests"),
    [
        (REST, True),
        (replace(REST, joint_velocities=np.full(12, 0.6)), False),
        (replace(REST, v_WB=np.array([0.0, 0.2, 0.0])), False),
        (_tilted(0.6), False),
    ],
)
def test_the_status_says_whether_the_robot_is_at_rest(state, rests):
    assert _watch(state, 0.1).status.at_rest == rests


def test_tilt_first_aborts_and_then_counts_as_a_fall():
    assert fall_reason(_tilted(0.6), ROBOT, SafetyConfig()) == ""
    assert "tilt" in fall_reason(_tilted(-0.9), ROBOT, SafetyConfig())
    folded = replace(REST, joint_positions=np.tile([0.0, 1.4, -2.7], 4) * np.repeat([1, 1, -1, -1], 3))
    assert "above its feet" in fall_reason(folded, ROBOT, SafetyConfig())


@pytest.mark.parametrize(
    ("state", "patience", "event", "word"),
    [
        (_tilted(0.6), 0.0, "attitude", "tilts"),
        (replace(REST, joint_velocities=np.full(12, 20.0)), 0.2, "joint_speed", "speed limit"),
        (replace(REST, w_WB=np.array([0.0, 6.0, 0.0])), 0.2, "joint_speed", "base turns"),
        (replace(REST, joint_torques=np.array(ROBOT.effort_limits)), 0.2, "torque", "torque limit"),
        (replace(REST, p_WB=REST.p_WB + np.array([0.0, 0.1, 0.0])), 0.0, "slip", "slipped by 0.10 m"),
        (replace(REST, contacts=np.array([True, False, True, True])), 0.3, "contact", "RF has found no ground"),
    ],
)
def test_each_event_makes_the_robot_unstable_until_it_is_calm(state, patience, event, word):
    memory = _watch(REST, 0.1)
    if patience:
        memory = _watch(state, patience - 0.05, memory)
        assert not memory.status.unstable, "a moment of it is normal"
    memory = _watch(state, 0.1, memory)
    assert (memory.status.unstable, memory.status.event) == (True, event)
    assert word in memory.status.reason
    assert memory.status.counts_by_event() == {event: 1}
    assert _watch(replace(REST, v_WB=np.array([0.3, 0.0, 0.0])), 2.0, memory).status.unstable
    memory = _watch(REST, 0.4, memory)
    assert memory.status.unstable
    memory = _watch(REST, 0.2, memory)
    assert not memory.status.unstable
    assert memory.status.counts_by_event() == {event: 1}


def test_a_foot_that_hangs_while_the_robot_rests_is_one_event_until_it_finds_ground():
    """A robot at rest on three legs can plan a step with the fourth; one event after the other would never let it."""
    hangs = replace(REST, contacts=np.array([True, True, False, True]))
    memory = _watch(hangs, 0.5)
    assert memory.status.unstable and "LH has found no ground" in memory.status.reason
    memory = _watch(hangs, 5.0, memory)
    assert not memory.status.unstable and sum(memory.status.counts) == 1
    other = replace(REST, contacts=np.array([False, True, False, True]))
    assert _watch(other, 0.5, memory).status.unstable, "another foot"
    memory = _watch(hangs, 0.5, _watch(REST, 0.1, memory))
    assert memory.status.unstable and sum(memory.status.counts) == 2, "it had found ground in between"


def test_the_reference_is_dropped_until_a_newer_one_comes():
    monitor = SafetyMonitor(ROBOT)
    context = monitor.CreateDefaultContext()
    reference = replace(WholeBodyReference.empty(), stamp=1.0, request_id=7)

    def published(unstable, released, abort=False):
        monitor.GetInputPort("reference").FixValue(context, reference)
        monitor.GetInputPort("abort").FixValue(context, abort)
        memory = SafetyMemory.empty()
        memory = replace(memory, status=replace(memory.status, unstable=unstable), released=released)
        context.SetAbstractState(0, _Remembered(None, ((0.0, memory),)))
        return monitor.GetOutputPort("safe_reference").Eval(context).request_id

    assert published(False, -np.inf) == 7
    assert published(False, -np.inf, abort=True) == 0
    assert published(True, np.inf) == 0
    assert published(False, 2.0) == 0
    assert published(False, 0.5) == 7


def test_every_event_has_its_count():
    assert len(SafetyMemory.empty().status.counts) == len(SAFETY_EVENTS)


def test_bounds_must_make_sense():
    with pytest.raises(UserInputError, match="max_tilt"):
        SafetyConfig(max_tilt=1.0, fall_tilt=0.5)
    with pytest.raises(UserInputError, match="max_slip"):
        SafetyConfig(max_slip=0.0)
