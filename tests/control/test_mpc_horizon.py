"""The MPC's view of the future: grid, reference samples, feet."""

import numpy as np
import pytest

from quadpips_drake.control import mpc_horizon as horizon
from quadpips_drake.control.gaits import load_gait
from quadpips_drake.control.standing import standing_state
from quadpips_drake.robots.legs import Leg
from quadpips_drake.robots.robot_model import load_robot
from quadpips_drake.trajectory.reference import ContactSchedule, FootholdTarget, WholeBodyReference


def test_the_grid_grows_from_its_first_step_to_the_horizon():
    grid = horizon.graded_grid(0.02, 1.0, 22)
    steps = np.diff(grid)
    assert len(steps) == 22
    assert steps[0] == pytest.approx(0.02, rel=1e-6)
    assert grid[-1] == pytest.approx(1.0)
    assert np.all(np.diff(steps) > 0.0)
    assert np.diff(horizon.graded_grid(0.05, 1.0, 20)) == pytest.approx(0.05)


def test_reference_yaw_continues_from_the_present_one():
    states = np.zeros((2, 24))
    states[:, 11] = -3.1, -3.0
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


class _Line:
    def __init__(self, start_time, end_time, start, end, normal):
        self.start_time, self.end_time, self.start, self.end = start_time, end_time, start, end

    def evaluate(self, time):
        ratio = (time - self.start_time) / (self.end_time - self.start_time)
        rate = (self.end - self.start) / (self.end_time - self.start_time)
        return self.start + ratio * (self.end - self.start), rate, np.zeros(3)


def test_swings_lead_from_the_feet_over_the_targets():
    schedule = load_gait("standing_trot").schedule(0.0, stop=2.0)
    feet = np.zeros((4, 3))
    targets = (
        FootholdTarget(Leg.RF, 0.0, 0.4, np.array([0.2, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])),
        FootholdTarget(Leg.RF, 1.0, 1.4, np.array([0.4, 0.0, 0.1]), np.array([0.0, 0.0, 1.0])),
    )
    swings = horizon.plan_swings(schedule, targets, feet, 0.1, 1.5, _Line)
    assert [len(s) for s in swings] == [1, 2, 2, 1]
    p, v = horizon.foot_references(swings, feet, np.array([0.1, 0.2, 0.7, 1.2, 1.5]))
    assert p[:, Leg.RF, 0] == pytest.approx([0.05, 0.1, 0.2, 0.3, 0.4])
    assert v[:, Leg.RF, 0] == pytest.approx([0.5, 0.5, 0.0, 0.5, 0.0])
    assert p[-1, Leg.RF, 2] == pytest.approx(0.1)
    assert np.all(p[:, Leg.LF] == 0.0)


def test_the_stance_feet_share_the_weight():
    inputs = horizon.weight_bearing_inputs(np.array([[True] * 4, [True, False, False, True]]), 10.0)
    assert inputs[:, :12].sum(axis=1) == pytest.approx(98.1)
    assert inputs[1, 2] == pytest.approx(49.05)


def test_an_early_touch_bears_load_but_a_late_foot_stays_planned():
    times = np.array([0.0, 0.1, 0.2, 0.5])
    line = _Line(-0.35, 0.15, np.zeros(3), np.ones(3), None)
    planned = np.array([[True, False, False, True], [True, True, True, True], [True] * 4])
    contacts = np.array([False, True, False, True])
    corrected = horizon.with_early_contacts(planned, times, contacts, ((), (line,), (line,), ()))
    assert corrected[0].tolist() == [True, True, False, True]
    assert (
        horizon.with_early_contacts(planned, times - 0.2, contacts, ((), (line,), (line,), ())).tolist() == planned.tolist()
    )
