"""Whole-body control: statics, limits, contact logic, and what happens when the program fails."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.whole_body import task_space_inverse_dynamics as wbc
from quadpips_drake.control.whole_body import whole_body_targets as targets
from quadpips_drake.control.whole_body.contact_logic import NO_SWING, foot_mode
from quadpips_drake.control.whole_body.whole_body_qp import QpSolution
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.trajectory.swing.swing_trajectory import SwingSpline
from quadpips_drake.values.centroidal import CentroidalInput, CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.whole_body_command import FootMode

ROBOTS = ("anymal_c", "go2")


def _standing_policy(robot, schedule=None) -> MpcPolicy:
    state = np.zeros(24)
    state[CentroidalState.POSITION] = standing_state(robot).p_WB
    state[CentroidalState.JOINTS] = robot.nominal_joints
    schedule = schedule or ContactSchedule.standing()
    down = schedule.at(0.0)
    forces = np.zeros(24)
    forces[CentroidalInput.VERTICAL_FORCES] = np.where(down, GRAVITY * robot.mass / down.sum(), 0.0)
    return MpcPolicy(
        stamp=0.0,
        times=np.array([0.0, 1.0]),
        states=np.stack((state, state)),
        inputs=forces[None],
        base_twists=np.zeros((2, 6)),
        schedule=schedule,
        normals=np.tile([0.0, 0.0, 1.0], (4, 1)),
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_standing_forces_carry_the_weight(name):
    robot = load_robot(name)
    control = wbc.TaskSpaceInverseDynamics(robot)
    command = control.compute(standing_state(robot), _standing_policy(robot), wbc.WholeBodyCommand.empty())
    assert command.success
    weight = GRAVITY * robot.mass
    assert command.forces.sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=0.01 * weight)
    assert np.all(command.forces[:, 2] > 0.0)


def test_a_foot_in_the_air_pushes_nothing_and_the_others_stay_in_their_cones():
    robot = load_robot("anymal_c")
    down = np.array([[True, False, False, True]])
    control = wbc.TaskSpaceInverseDynamics(robot)
    policy = _standing_policy(robot, ContactSchedule(np.zeros(0), down))
    state = replace(standing_state(robot), v_WB=np.array([0.5, 0.5, 0.0]))
    command = control.compute(state, policy, wbc.WholeBodyCommand.empty())
    assert command.success
    assert np.abs(command.forces[1:3]).max() < 0.1
    sideways = np.linalg.norm(command.forces[:, :2], axis=1)
    assert np.all(sideways <= wbc.WbcConfig().friction * command.forces[:, 2] + 0.1)


def test_torque_limits_hold():
    robot = load_robot("anymal_c")
    weak = replace(robot, effort_limits=np.full(12, 15.0))
    command = wbc.TaskSpaceInverseDynamics(weak).compute(
        standing_state(robot), _standing_policy(robot), wbc.WholeBodyCommand.empty()
    )
    assert command.success
    assert np.abs(command.torque).max() <= 15.0


def test_without_a_policy_the_robot_holds_its_nominal_stance():
    robot = load_robot("go2")
    command = wbc.TaskSpaceInverseDynamics(robot).compute(
        standing_state(robot), MpcPolicy.empty(), wbc.WholeBodyCommand.empty()
    )
    assert command.status == "standing"
    assert command.joint_positions == pytest.approx(robot.nominal_joints)


def test_a_failed_program_is_counted_and_has_a_fallback(monkeypatch):
    robot = load_robot("go2")
    control = wbc.TaskSpaceInverseDynamics(robot)
    policy = _standing_policy(robot)
    good = control.compute(standing_state(robot), policy, wbc.WholeBodyCommand.empty())
    failed = QpSolution(False, "max_iter_reached", 100, np.zeros(30), np.zeros(6), np.zeros(32))
    monkeypatch.setattr(control._method._qp, "solve", lambda *args: failed)
    bad = control.compute(standing_state(robot, 0.002), policy, good)
    assert (bad.success, bad.status, bad.fallbacks) == (False, "max_iter_reached", 1)
    assert bad.torque == pytest.approx(good.torque)  # at rest the damping adds nothing
    for i in range(wbc.WbcConfig().max_consecutive_failures):
        bad = control.compute(standing_state(robot, 0.004 + 0.002 * i), policy, bad)
    assert bad.joint_positions == pytest.approx(robot.nominal_joints)
    assert bad.fallbacks == wbc.WbcConfig().max_consecutive_failures + 1


def test_a_state_that_is_not_a_number_fails_cleanly():
    robot = load_robot("go2")
    control = wbc.TaskSpaceInverseDynamics(robot)
    policy = _standing_policy(robot)
    good = control.compute(standing_state(robot), policy, wbc.WholeBodyCommand.empty())
    blown_up = replace(standing_state(robot, 0.002), joint_velocities=np.full(12, np.nan))
    bad = control.compute(blown_up, policy, good)
    assert not bad.success
    assert "not a number" in bad.status


_PATH = SwingSpline(np.zeros(3), np.ones(3), 0.0, 0.4).path


@pytest.mark.parametrize(
    ("planned", "sensed", "last", "time", "mode"),
    [
        (True, True, FootMode.SWING, 0.5, FootMode.STANCE),
        (True, False, FootMode.SWING, 0.5, FootMode.SEARCH),
        (True, False, FootMode.SEARCH, 0.5, FootMode.SEARCH),
        (True, False, FootMode.STANCE, 0.5, FootMode.STANCE),
        (False, False, FootMode.SWING, 0.3, FootMode.SWING),
        (False, True, FootMode.SWING, 0.1, FootMode.SWING),
        (False, True, FootMode.SWING, 0.35, FootMode.EARLY),
    ],
)
def test_planned_and_sensed_contact_decide_the_mode(planned, sensed, last, time, mode):
    assert foot_mode(planned, sensed, int(last), _PATH, time, 0.6) == mode


def test_a_foot_without_a_swing_stands_unless_its_swing_was_dropped():
    assert foot_mode(True, False, int(FootMode.STANCE), NO_SWING, 0.5, 0.6) == FootMode.STANCE
    assert foot_mode(True, False, int(FootMode.SWING), NO_SWING, 0.5, 0.6) == FootMode.SEARCH
    assert foot_mode(False, True, int(FootMode.SWING), NO_SWING, 0.5, 0.6) == FootMode.SWING


def test_rotation_error_is_the_rotation_vector_for_small_angles():
    R = rotation_from_rpy(np.array([0.1, -0.2, 0.7]))
    assert targets.rotation_error(np.array([0.1, -0.2, 0.7]), R) == pytest.approx(np.zeros(3), abs=1e-12)
    assert targets.rotation_error(np.array([0.0, 0.0, 0.3]), np.eye(3)) == pytest.approx([0.0, 0.0, 2.0 * np.sin(0.15)])


@pytest.mark.parametrize("solver", ["proxqp", "clarabel"])
def test_other_solvers_agree(solver):
    robot = load_robot("anymal_c")
    policy = _standing_policy(robot, ContactSchedule(np.zeros(0), np.array([[True, False, False, True]])))
    state = replace(standing_state(robot), v_WB=np.array([0.2, 0.1, 0.0]))
    dense = wbc.TaskSpaceInverseDynamics(robot).compute(state, policy, wbc.WholeBodyCommand.empty())
    other = wbc.TaskSpaceInverseDynamics(robot, wbc.WbcConfig(solver=solver)).compute(
        state, policy, wbc.WholeBodyCommand.empty()
    )
    assert other.success
    assert other.torque == pytest.approx(dense.torque, abs=0.05)
