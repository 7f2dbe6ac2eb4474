"""The walk by velocity command: the base follows the command, feet land below it, the walk begins and ends standing."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.references.ground_plane import GroundPlane, fitted_plane
from quadpips_drake.control.references.velocity_reference import VelocityWalk, WalkMemory, advance
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.centroidal import CentroidalInput

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
    assert reference.inputs[0, CentroidalInput.VERTICAL_FORCES].sum() == pytest.approx(GRAVITY * ROBOT.mass)
    for target in reference.footholds:
        nominal = (
            memory.pose[0] + ROBOT.nominal_footholds_B[target.leg, 0] + 0.3 * (target.touchdown_time + 0.15 - memory.stamp)
        )
        assert target.position[0] == pytest.approx(nominal, abs=0.0061), "the robot is a step behind its reference"
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


def test_a_command_beyond_the_legs_reach_is_scaled_down():
    fast = _follow(VelocityWalk(ROBOT), WalkMemory.empty(), [0.3, 0.0, 0.0], "standing_walk", 0.0, 3.0)
    assert 0.1 < fast.velocity[0] < 0.25


def test_the_plane_goes_through_the_feet_and_the_base_follows_it():
    angle = np.radians(15.0)
    rng = np.random.default_rng(0)
    xy = rng.uniform(-0.4, 0.4, (4, 2))
    points = np.column_stack((xy, np.tan(angle) * xy[:, 0] + 0.1))
    plane = fitted_plane(points, np.zeros(2))
    assert plane.at(np.array([1.0, 0.5])) == pytest.approx(np.tan(angle) + 0.1, abs=0.03)
    assert plane.inclination(0.0) == pytest.approx([0.0, -angle], abs=0.01), "nose up on the way up"
    assert plane.inclination(np.pi) == pytest.approx([0.0, angle], abs=0.01)
    assert plane.inclination(0.5 * np.pi) == pytest.approx([-angle, 0.0], abs=0.01), "left (downhill) side down: roll < 0"
    level = GroundPlane(np.zeros(2), 0.0, np.zeros(2))
    for _ in range(200):
        level = level.improved(points, np.zeros(2), 0.1, 0.03)
    assert level.slope == pytest.approx(plane.slope, abs=0.01)


def test_feet_are_placed_below_the_robot_and_against_its_drift():
    walk = VelocityWalk(ROBOT)
    memory = _follow(walk, WalkMemory.empty(), [0.0, 0.0, 0.0], "trot", 0.0, 1.5)
    here = replace(
        standing_state(ROBOT, 1.5), p_WB=np.array([0.0, 0.05, ROBOT.nominal_base_height]), contacts=np.ones(4, dtype=bool)
    )
    moved = walk.update(memory, here, np.zeros(3), load_gait("trot")).reference.footholds
    pushed = walk.update(
        memory, replace(here, v_WB=np.array([0.0, 0.3, 0.0])), np.zeros(3), load_gait("trot")
    ).reference.footholds
    height = -ROBOT.nominal_footholds_B[:, 2].mean()
    for a, b in zip(moved, pushed, strict=True):
        assert a.position[1] == pytest.approx(0.05 + ROBOT.nominal_footholds_B[a.leg, 1], abs=2e-3)
        assert b.position[1] - a.position[1] == pytest.approx(0.3 * np.sqrt(height / GRAVITY), rel=1e-6)


def test_a_foothold_does_not_move_any_more_late_in_its_swing():
    walk = VelocityWalk(ROBOT)
    memory = _follow(walk, WalkMemory.empty(), [0.3, 0.0, 0.0], "trot", 0.0, 2.0)
    moves = {"early": [], "late": []}
    for now in np.arange(2.0, 3.0, 0.02):
        pushed = replace(
            standing_state(ROBOT, now),
            p_WB=np.array([*memory.pose[:2], ROBOT.nominal_base_height]),
            v_WB=np.array([0.3, np.sin(40.0 * now), 0.0]),
        )
        before = {(t.leg, round(t.touchdown_time, 3)): t for t in memory.reference.footholds}
        memory = walk.update(memory, pushed, np.array([0.3, 0.0, 0.0]), load_gait("trot"))
        for target in memory.reference.footholds:
            last = before.get((target.leg, round(target.touchdown_time, 3)))
            phase = (now - target.liftoff_time) / (target.touchdown_time - target.liftoff_time)
            if last is not None and 0.0 < phase < 1.0:
                moves["late" if phase > 0.8 else "early"].append(np.abs(target.position - last.position).max())
    assert max(moves["early"]) > 0.01
    assert max(moves["late"]) == 0.0
