"""The walk by velocity command: the base follows the command, feet land below it, the walk begins and ends standing."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.gaits import load_gait
from quadpips_drake.control.standing import standing_state
from quadpips_drake.control.velocity_reference import VelocityWalk, WalkMemory, advance, wrapped
from quadpips_drake.robots.robot_model import load_robot

ROBOT = load_robot("go2")


def _follow(walk, memory, command, gait, start, stop):
    """A robot that is always where its reference is, with its feet on level ground."""
    for now in np.arange(start, stop, 0.02):
        x, y, yaw = memory.pose
        state = replace(
            standing_state(ROBOT, now),
            p_WB=np.array([x, y, ROBOT.nominal_base_height]),
            rpy_WB=np.array([0.0, 0.0, yaw]),
            v_WB=np.array([*memory.velocity[:2], 0]),
            contacts=np.ones(4, dtype=bool),
        )
        memory = walk.update(memory, state, np.asarray(command, float), load_gait(gait))
    return memory


def test_moves_with_the_command_and_stops_standing():
    walk = VelocityWalk(ROBOT)
    memory = _follow(walk, WalkMemory.empty(), [0.3, 0.0, 0.0], "trot", 0.0, 3.0)
    assert memory.velocity == pytest.approx([0.3, 0.0, 0.0])
    assert memory.pose[0] > 0.5
    reference = memory.reference
    assert not reference.schedule.at(reference.times[0]).all()
    assert reference.inputs[0, 2:12:3].sum() == pytest.approx(9.81 * ROBOT.mass)
    for target in reference.footholds:
        nominal = (
            memory.pose[0] + ROBOT.nominal_footholds_B[target.leg, 0] + 0.3 * (target.touchdown_time + 0.15 - memory.stamp)
        )
        assert target.position[0] == pytest.approx(nominal, abs=1e-6)
        assert target.position[2] == pytest.approx(ROBOT.foot_radius, abs=1e-6)
    memory = _follow(walk, memory, [0.3, 0.0, 0.0], "stance", 3.0, 6.0)
    assert memory.velocity == pytest.approx([0.0, 0.0, 0.0])
    assert memory.timeline.gait.name == "stance"
    assert memory.reference.schedule.at(6.0).all()
    assert memory.reference.footholds == ()


def test_a_zero_velocity_is_a_walk_on_the_spot():
    memory = _follow(VelocityWalk(ROBOT), WalkMemory.empty(), [0.0, 0.0, 0.0], "trot", 0.0, 2.0)
    assert memory.pose == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert len(memory.reference.footholds) > 4


def test_advance_goes_round_a_circle():
    pose = np.zeros(3)
    for _ in range(100):
        pose = advance(pose, np.array([0.5, 0.0, 1.0]), 2.0 * np.pi / 100)
    assert pose == pytest.approx([0.0, 0.0, 2.0 * np.pi], abs=1e-9)
    assert wrapped(3.5) == pytest.approx(3.5 - 2.0 * np.pi)


def test_a_command_beyond_the_legs_reach_is_scaled_down():
    fast = _follow(VelocityWalk(ROBOT), WalkMemory.empty(), [0.3, 0.0, 0.0], "standing_walk", 0.0, 3.0)
    assert 0.1 < fast.velocity[0] < 0.25
