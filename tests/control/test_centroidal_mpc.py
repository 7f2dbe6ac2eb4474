"""The MPC: statics, footholds, failures, and what it remembers."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.centroidal_mpc import CentroidalMpc, MpcConfig, MpcMemory
from quadpips_drake.control.gaits import load_gait
from quadpips_drake.control.reference_publisher import no_reference
from quadpips_drake.control.standing import standing_state
from quadpips_drake.control.velocity_reference import VelocityWalk, WalkMemory
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.legs import Leg
from quadpips_drake.robots.robot_model import load_robot


def _solve(mpc, robot, reference, times, memory=None):
    memory = memory or MpcMemory.empty()
    for now in times:
        memory = mpc.compute(standing_state(robot, now), reference, memory)
    return memory


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_standing_forces_carry_the_weight_and_the_base_stays(name):
    robot = load_robot(name)
    policy = _solve(CentroidalMpc(robot), robot, no_reference(), np.arange(0.0, 0.1, 0.02)).policy
    assert policy.success
    forces = policy.inputs[:, :12].reshape(-1, 4, 3)
    weight = 9.81 * robot.mass
    assert forces[0].sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=0.03 * weight)
    assert np.abs(policy.states[:, 6:9] - standing_state(robot).p_WB).max() < 0.01
    assert np.abs(policy.base_twists).max() < 0.1


def test_swinging_feet_bear_nothing_and_aim_at_their_footholds():
    robot = load_robot("anymal_c")
    walk = VelocityWalk(robot, load_gait("trot"))
    memory = walk.update(WalkMemory.empty(), standing_state(robot), np.array([0.3, 0.0, 0.0]))
    memory = walk.update(memory, standing_state(robot, 0.02), np.array([0.3, 0.0, 0.0]))
    policy = _solve(CentroidalMpc(robot), robot, memory.reference, [0.02, 0.04, 0.06]).policy
    assert policy.success
    middle = 0.5 * (policy.times[:-1] + policy.times[1:])
    forces = policy.inputs[:, :12].reshape(-1, 4, 3)
    for k, t in enumerate(middle):
        assert np.abs(forces[k][~policy.schedule.at(t)]).max(initial=0.0) < 1e-3
    first = next(f for f in memory.reference.footholds if f.leg == Leg.RF)
    spline = policy.swings[Leg.RF][0]
    assert spline.end_time == pytest.approx(first.touchdown_time)
    assert spline.evaluate(spline.end_time)[0] == pytest.approx(first.position, abs=1e-6)


def test_without_a_reference_the_stance_is_latched():
    robot = load_robot("go2")
    mpc = CentroidalMpc(robot)
    memory = _solve(mpc, robot, no_reference(), [0.0])
    pushed = replace(standing_state(robot, 0.02), p_WB=np.array([0.05, 0.0, robot.nominal_base_height]))
    later = mpc.compute(pushed, no_reference(), memory)
    assert later.standing is memory.standing


def test_failures_are_counted_and_end_in_standing(monkeypatch):
    robot = load_robot("go2")
    mpc = CentroidalMpc(robot)
    good = _solve(mpc, robot, no_reference(), [0.0])
    solution = mpc._problem.iterate
    monkeypatch.setattr(
        mpc._problem, "iterate", lambda *a, **k: replace(solution(*a, **k), success=False, status="made to fail")
    )
    bad = _solve(mpc, robot, no_reference(), [0.02, 0.04], good)
    assert not bad.policy.success
    assert bad.policy.status == "made to fail"
    assert bad.policy.fallbacks == 2
    assert bad.policy.states is good.policy.states


def test_bad_horizons_are_refused():
    with pytest.raises(UserInputError, match="horizon"):
        MpcConfig(horizon=0.0)
