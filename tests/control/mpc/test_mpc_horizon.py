"""The MPC's view of the future: grid, reference samples, feet."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.mpc import mpc_horizon as horizon
from quadpips_drake.control.mpc import mpc_swings
from quadpips_drake.control.mpc.mpc_config import graded_grid
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.trajectory.swing.swing_trajectory import SwingConfig, SwingSpline
from quadpips_drake.values.centroidal import CentroidalInput, CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.regions import PlanarRegion


def test_the_grid_grows_from_its_first_step_to_the_horizon():
    grid = graded_grid(0.02, 1.0, 22)
    steps = np.diff(grid)
    assert len(steps) == 22
    assert steps[0] == pytest.approx(0.02, rel=1e-6)
    assert grid[-1] == pytest.approx(1.0)
    assert np.all(np.diff(steps) > 0.0)
    assert np.diff(graded_grid(0.05, 1.0, 20)) == pytest.approx(0.05)


def test_reference_yaw_continues_from_the_present_one():
    states = np.zeros((2, 24))
    states[:, CentroidalState.YAW] = -3.1, -3.0
    states[:, 0] = 0.5
    reference = WholeBodyReference(0.0, 1, np.array([0.0, 1.0]), states, np.zeros((2, 24)), ContactSchedule.standing())
    sampled = horizon.sampled_states(reference, np.array([0.0, 0.5, 2.0]), yaw=3.1)
    assert sampled[0, 11] == pytest.approx(2 * np.pi - 3.1)
    assert sampled[1, 0] == 0.5
    assert sampled[2, 0] == 0.0  # at rest after the end


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_the_standing_pose_of_the_nominal_stance_is_nominal(name):
    robot = load_robot(name)
    state = standing_state(robot)
    pose = horizon.standing_pose(state, robot)
    assert pose.p_WB == pytest.approx(state.p_WB, abs=1e-3)
    assert pose.rpy_WB == pytest.approx(np.zeros(3), abs=1e-3)


def test_feet_in_the_air_do_not_lift_the_standing_pose():
    robot = load_robot("anymal_c")
    state = standing_state(robot)
    joints = state.joint_positions.copy()
    in_the_air = robot.nominal_footholds_B[Leg.LF] + [0.0, 0.0, 0.15]
    joints[:3], reached = robot.leg_inverse_kinematics_B(Leg.LF, in_the_air)
    assert reached
    contacts = np.array([False, True, True, True])
    pose = horizon.standing_pose(replace(state, joint_positions=joints, contacts=contacts), robot)
    assert pose.p_WB == pytest.approx(state.p_WB, abs=2e-3)
    assert pose.rpy_WB == pytest.approx(np.zeros(3), abs=2e-3)


def test_swings_lead_from_the_feet_over_the_targets():
    schedule = load_gait("standing_trot").schedule(0.0, stop=2.0)
    feet, up = np.zeros((4, 3)), np.tile([0.0, 0.0, 1.0], (4, 1))
    targets = (
        FootholdTarget(Leg.RF, 0.0, 0.4, np.array([0.2, 0.0, 0.0]), up[0]),
        FootholdTarget(Leg.RF, 1.0, 1.4, np.array([0.4, 0.0, 0.1]), up[0]),
    )
    planner = mpc_swings.SwingPlanner(SwingConfig(), 0.03)
    swings = planner.plan(schedule, targets, feet, up, 0.1, 1.5)
    assert [len(s) for s in swings] == [1, 2, 2, 1]
    times = np.array([0.1, 0.2, 0.7, 1.2, 1.5])
    p, v = mpc_swings.foot_references(swings, feet, times)
    assert p[[2, 4], Leg.RF] == pytest.approx(np.array([[0.2, 0.0, 0.0], [0.4, 0.0, 0.1]]))
    for k, spline in ((0, 0), (1, 0), (3, 1)):
        expected = swings[Leg.RF][spline].evaluate(times[k])
        assert p[k, Leg.RF] == pytest.approx(expected[0])
        assert v[k, Leg.RF] == pytest.approx(expected[1])
    assert np.all(v[[2, 4], Leg.RF] == 0.0)
    assert np.all(p[:, Leg.LF, :2] == 0.0)
    again = planner.plan(schedule, targets, feet + 5e-4, up, 0.12, 1.5, swings)
    assert again[Leg.RF][0] is swings[Leg.RF][0]
    moved = planner.plan(schedule, targets, feet + 5e-3, up, 0.12, 1.5, swings)
    assert moved[Leg.RF][0].start_point == pytest.approx(np.full(3, 5e-3))
    assert moved[Leg.RF][1] is swings[Leg.RF][1]


def test_normals_last_from_touch_down_to_the_next_lift_off():
    up, slope = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.6, 0.8])
    targets = (
        FootholdTarget(Leg.LF, 0.0, 0.4, np.zeros(3), slope),
        FootholdTarget(Leg.LF, 1.0, 1.4, np.zeros(3), up),
        FootholdTarget(Leg.RF, 1.0, 1.4, np.zeros(3), slope),
    )
    standing = mpc_swings.standing_normals(targets, np.tile(up, (4, 1)), 0.5)
    assert standing[Leg.LF] == pytest.approx(slope)
    assert standing[Leg.RF] == pytest.approx(up)
    normals = mpc_swings.ground_normals(targets[1:], standing, np.array([0.5, 0.9, 1.2, 1.6]))
    assert normals[:, Leg.LF] == pytest.approx(np.array([slope, up, up]))
    assert normals[:, Leg.RF] == pytest.approx(np.array([up, slope, slope]))


def test_regions_bind_feet_from_their_touch_down_on():
    square = 0.1 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    region = PlanarRegion(3, np.eye(4), square, square)
    target = FootholdTarget(Leg.LH, 0.1, 0.4, np.zeros(3), np.array([0.0, 0.0, 1.0]), region)
    times = np.array([0.0, 0.2, 0.4, 0.6])
    normals, offsets = mpc_swings.foothold_halfspaces((target,), times)
    assert normals.shape == (3, 4, 4, 3)
    assert not normals[:2].any() and not normals[:, [0, 1, 3]].any()
    inside, outside = np.array([0.05, 0.0, 0.3]), np.array([0.0, 0.12, 0.0])
    assert np.all(normals[2, Leg.LH] @ inside + offsets[2, Leg.LH] > 0.0)
    assert np.min(normals[2, Leg.LH] @ outside + offsets[2, Leg.LH]) == pytest.approx(-0.02)
    assert mpc_swings.foothold_halfspaces((target,), times + 1.0) == (None, None)


def test_the_stance_feet_share_the_weight():
    inputs = horizon.weight_bearing_inputs(np.array([[True] * 4, [True, False, False, True]]), 10.0)
    assert inputs[:, CentroidalInput.FORCES].sum(axis=1) == pytest.approx(98.1)
    assert inputs[1, 2] == pytest.approx(49.05)


def test_inputs_of_the_last_solution_are_held_where_its_contacts_still_count():
    old_times, times = np.array([0.0, 0.1, 0.2, 0.3]), np.array([0.02, 0.12, 0.22, 0.32])
    old_inputs = np.arange(72.0).reshape(3, 24) + 1.0
    old_inputs[1, 3:6] = 0.0  # RF swings
    stance = np.array([[True] * 4, [True, False, True, True], [True] * 4])
    u_ref = np.full((3, 24), -1.0)
    held = horizon.held_inputs(times, stance, u_ref, old_times, old_inputs)
    np.testing.assert_array_equal(held, old_inputs)
    late = horizon.held_inputs(times + 0.1, stance, u_ref, old_times, old_inputs)
    np.testing.assert_array_equal(late[:, CentroidalInput.JOINT_VELOCITIES], old_inputs[[1, 2, 2], 12:])
    assert (late[0, :12] == -1.0).all()  # RF is down now
    assert (late[1, :12] == -1.0).all()  # RF swings now
    assert (late[2, :12] == -1.0).all()  # beyond the last solution


def test_an_early_touch_bears_load_but_a_late_foot_stays_planned():
    times = np.array([0.0, 0.1, 0.2, 0.5])
    line = SwingSpline(np.zeros(3), np.ones(3), -0.35, 0.15)
    planned = np.array([[True, False, False, True], [True, True, True, True], [True] * 4])
    contacts = np.array([False, True, False, True])
    swings = ((), (line,), (line,), ())
    corrected = horizon.with_early_contacts(planned, times, contacts, swings, 0.6)
    assert corrected[0].tolist() == [True, True, False, True]
    earlier = horizon.with_early_contacts(planned, times - 0.2, contacts, swings, 0.6)
    assert earlier.tolist() == planned.tolist()
    # 70 % of the swing are over.
    assert horizon.with_early_contacts(planned, times, contacts, swings, 0.69)[0, 1]
    assert not horizon.with_early_contacts(planned, times, contacts, swings, 0.71)[0, 1]


def test_a_swing_that_is_planned_anew_is_as_high_as_it_was_planned():
    up, radius = np.array([0.0, 0.0, 1.0]), 0.03
    profile = np.full(25, radius)
    profile[11:14] += 0.12  # a barrier
    start, end = np.array([0.0, 0.0, radius]), np.array([0.4, 0.0, radius])
    planned = SwingSpline.plan(0.0, 0.4, start, end, up, SwingConfig(), profile=profile)
    target = FootholdTarget(Leg.LF, 0.0, 0.4, end, up, None, planned.profile, planned.apex_height)
    schedule = ContactSchedule(np.array([0.0, 0.4]), np.array([[True] * 4, [False, True, True, True], [True] * 4]))
    feet = np.tile(start, (4, 1)) + np.array([0.02, 0.01, 0.004])  # where it really stands
    swings = mpc_swings.SwingPlanner(SwingConfig(), radius).plan(schedule, (target,), feet, np.tile(up, (4, 1)), -0.1, 1.0)
    times = np.linspace(0.0, 0.4, 100)
    path, wanted = swings[Leg.LF][0].position(times), planned.position(times)
    assert wanted[:, 2].max() > radius + 0.12 + 0.015
    assert path[:, 2].max() > wanted[:, 2].max() - 0.005
    over = np.abs(path[:, 0] - 0.2) < 0.03
    assert path[over, 2].min() > 0.12 + radius
    bare = mpc_swings.SwingPlanner(SwingConfig(), radius).plan(
        schedule, (FootholdTarget(Leg.LF, 0.0, 0.4, end, up),), feet, np.tile(up, (4, 1)), -0.1, 1.0
    )
    assert bare[Leg.LF][0].position(times)[:, 2].max() < 0.13
