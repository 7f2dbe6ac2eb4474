"""The MPC: statics, footholds, failures, and what it remembers."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.mpc.real_time_iteration import MpcConfig, MpcMemory, RealTimeIteration
from quadpips_drake.control.references.velocity_reference import VelocityWalk, WalkMemory
from quadpips_drake.errors import UserInputError
from quadpips_drake.faults.failing_solver import FailingSolver
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.trajectory.ocp.ocp_config import OcpConfig
from quadpips_drake.values.centroidal import CentroidalInput, CentroidalState, foot_forces
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.reference import WholeBodyReference


def _solve(mpc, robot, reference, times, memory=None, solver=None):
    memory = memory or MpcMemory.empty()
    for now in times:
        memory = mpc.compute(standing_state(robot, now), reference, memory, solver)
    return memory


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_standing_forces_carry_the_weight_and_the_base_stays(name):
    robot = load_robot(name)
    policy = _solve(RealTimeIteration(robot), robot, WholeBodyReference.empty(), np.arange(0.0, 0.1, 0.02)).policy
    assert policy.success
    forces = foot_forces(policy.inputs)
    weight = GRAVITY * robot.mass
    assert forces[0].sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=0.03 * weight)
    assert np.abs(policy.states[:, CentroidalState.POSITION] - standing_state(robot).p_WB).max() < 0.01
    assert np.abs(policy.base_twists).max() < 0.1


def test_swinging_feet_bear_nothing_and_aim_at_their_footholds():
    robot = load_robot("anymal_c")
    walk, trot = VelocityWalk(robot), load_gait("trot")
    memory = walk.update(WalkMemory.empty(), standing_state(robot), np.array([0.3, 0.0, 0.0]), trot)
    memory = walk.update(memory, standing_state(robot, 0.02), np.array([0.3, 0.0, 0.0]), trot)
    policy = _solve(RealTimeIteration(robot), robot, memory.reference, [0.02, 0.04, 0.06]).policy
    assert policy.success
    middle = 0.5 * (policy.times[:-1] + policy.times[1:])
    forces = foot_forces(policy.inputs)
    for k, t in enumerate(middle):
        assert np.abs(forces[k][~policy.schedule.at(t)]).max(initial=0.0) < 1e-3
    first = next(f for f in memory.reference.footholds if f.leg == Leg.RF)
    spline = policy.swings[Leg.RF][0]
    assert spline.end_time == pytest.approx(first.touchdown_time)
    assert spline.evaluate(spline.end_time)[0] == pytest.approx(first.position, abs=1e-6)


def test_without_a_reference_the_stance_is_latched():
    robot = load_robot("go2")
    mpc = RealTimeIteration(robot)
    memory = _solve(mpc, robot, WholeBodyReference.empty(), [0.0])
    pushed = replace(standing_state(robot, 0.02), p_WB=np.array([0.05, 0.0, robot.nominal_base_height]))
    later = mpc.compute(pushed, WholeBodyReference.empty(), memory)
    assert later.standing is memory.standing


def test_failures_are_counted_and_carry_the_policy_on():
    robot = load_robot("go2")
    mpc = RealTimeIteration(robot)
    good = _solve(mpc, robot, WholeBodyReference.empty(), [0.0])
    bad = _solve(mpc, robot, WholeBodyReference.empty(), [0.02, 0.04], good, FailingSolver())
    assert not bad.policy.success
    assert "fails on purpose" in bad.policy.status
    assert bad.policy.fallbacks == 2
    assert bad.policy.states is good.policy.states
    assert bad.consecutive_failures == 2
    after = _solve(mpc, robot, WholeBodyReference.empty(), [0.06], bad)
    assert after.policy.success and after.policy.fallbacks == 2 and after.consecutive_failures == 0


def test_many_failures_end_in_standing():
    robot = load_robot("anymal_c")
    walk, trot = VelocityWalk(robot), load_gait("trot")
    reference = walk.update(WalkMemory.empty(), standing_state(robot), np.array([0.3, 0.0, 0.0]), trot).reference
    mpc = RealTimeIteration(robot, MpcConfig(max_consecutive_failures=2))
    good = _solve(mpc, robot, reference, [0.0])
    bad = _solve(mpc, robot, reference, [0.02, 0.04, 0.06, 0.08], good, FailingSolver())
    done = _solve(mpc, robot, reference, [0.1], bad)
    assert done.standing is not None
    assert done.policy.success
    assert not any(done.policy.swings)


def test_the_uniform_grid_of_the_paper():
    robot, config = load_robot("anymal_c"), MpcConfig(grid="uniform")
    assert len(config.knots()) == 68
    assert np.diff(config.knots()) == pytest.approx(0.015, rel=0.01)
    assert len(MpcConfig().knots()) <= 26
    policy = _solve(RealTimeIteration(robot, config), robot, WholeBodyReference.empty(), [0.0, 0.02]).policy
    assert policy.success and len(policy.inputs) == 67


def test_the_single_rigid_body_stands_too():
    robot = load_robot("anymal_c")
    mpc = RealTimeIteration(robot, MpcConfig(ocp=OcpConfig(model="single_rigid_body")))
    policy = _solve(mpc, robot, WholeBodyReference.empty(), [0.0, 0.02]).policy
    assert policy.success
    assert policy.inputs[0, CentroidalInput.VERTICAL_FORCES].sum() == pytest.approx(GRAVITY * robot.mass, rel=0.03)


def test_equal_memories_give_equal_policies():
    robot = load_robot("anymal_c")
    mpc = RealTimeIteration(robot)
    memory = _solve(mpc, robot, WholeBodyReference.empty(), [0.0, 0.02])
    one = _solve(mpc, robot, WholeBodyReference.empty(), [0.04], memory)
    _solve(mpc, robot, WholeBodyReference.empty(), [0.06, 0.08], one)
    other = _solve(RealTimeIteration(robot), robot, WholeBodyReference.empty(), [0.04], memory)
    np.testing.assert_array_equal(one.policy.inputs, other.policy.inputs)
    np.testing.assert_array_equal(one.policy.states, other.policy.states)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"horizon": 0.0}, "horizon"),
        ({"grid": "fine"}, "unknown MPC grid 'fine'"),
        ({"latency": -0.1}, "latency must be"),
        ({"latency": 1.0}, "latency must be shorter than the horizon"),
        ({"uniform_interval": 0.7}, "uniform_interval"),
    ],
)
def test_bad_settings_are_refused(setting, message):
    with pytest.raises(UserInputError, match=message):
        MpcConfig(**setting)
