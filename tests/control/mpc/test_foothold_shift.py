"""Footholds that move with the robot, within their regions, until the middle of the swing."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.mpc.foothold_shift import FootholdShiftConfig, capture_point_error, shifted, shifts
from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.control.mpc.real_time_iteration import MpcMemory, RealTimeIteration
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from tests.planning.worlds import patch

UP = np.array([0.0, 0.0, 1.0])
CONFIG = FootholdShiftConfig(max_shift=0.10, gain=1.0, dead_zone=0.02)


def target(leg=Leg.LF, region=None, liftoff=1.0, touchdown=1.4):
    region = region or patch(0, 0.4, 0.2, 0.5, 0.5, margin=0.05)
    return FootholdTarget(leg, liftoff, touchdown, region.center + 0.03 * region.normal, region.normal, region)


def test_the_capture_point_is_off_by_place_and_speed():
    x, reference = np.zeros(24), np.zeros(24)
    x[CentroidalState.POSITION] = [0.02, -0.01, 0.5]
    x[CentroidalState.LINEAR] = [0.0, 0.3, 0.0]
    expected = [0.02, -0.01 + 0.3 * np.sqrt(0.5 / GRAVITY)]
    np.testing.assert_allclose(capture_point_error(x, reference, 0.5), expected)


@pytest.mark.parametrize(
    ("error", "offset"), [((0.015, 0.0), (0.0, 0.0)), ((0.05, 0.0), (0.03, 0.0)), ((0.0, -0.5), (0.0, -0.10))]
)
def test_small_errors_are_left_to_forces_and_large_ones_bounded(error, offset):
    (shift,) = shifts(np.array(error), (target(),), (), 0.9, CONFIG)
    np.testing.assert_allclose(shift.offset, [*offset, 0.0], atol=1e-12)


def test_a_foothold_stays_on_its_region():
    region = patch(0, 0.4, 0.2, 0.16, 0.16, margin=0.05, slope=0.3)
    (shift,) = shifts(np.array([0.2, 0.0]), (target(region=region),), (), 0.9, CONFIG)
    local = region.X_WR[:3, :3].T @ shift.offset
    np.testing.assert_allclose(local, [0.03, 0.0, 0.0], atol=1e-9)


def test_unknown_ground_is_not_stepped_on():
    nowhere = replace(target(), region=None)
    assert not shifts(np.array([0.2, 0.0]), (nowhere,), (), 0.9, CONFIG)[0].offset.any()


def test_only_the_next_touchdown_of_a_leg_moves_and_only_until_the_middle_of_its_swing():
    footholds = (target(), target(Leg.RH, liftoff=1.5, touchdown=1.9), target(liftoff=2.0, touchdown=2.4))
    before = shifts(np.array([0.07, 0.0]), footholds, (), 1.1, CONFIG)
    assert [(shift.leg, shift.touchdown_time) for shift in before] == [(Leg.LF, 1.4), (Leg.RH, 1.9)]
    late, early = shifts(np.array([0.0, 0.05]), footholds, before, 1.3, CONFIG)
    np.testing.assert_array_equal(late.offset, before[0].offset)
    np.testing.assert_allclose(early.offset, [0.0, 0.03, 0.0])
    moved = shifted(footholds, (late, early))
    np.testing.assert_allclose(moved[0].position, footholds[0].position + late.offset)
    assert moved[2] is footholds[2]


def test_by_default_footholds_stay():
    footholds = (target(),)
    assert shifts(np.array([0.2, 0.0]), footholds, (), 0.9, FootholdShiftConfig()) == ()
    assert shifted(footholds, ()) is footholds


@pytest.mark.parametrize(("most", "aside"), [(0.0, 0.0), (0.08, 0.08)])
def test_the_mpc_of_a_pushed_robot_steps_aside(most, aside):
    robot = load_robot("anymal_c")
    standing = CentroidalModel(robot).nominal_state()
    foot = CentroidalModel(robot).foot_positions(standing)[Leg.LF]
    region = patch(0, foot[0], foot[1], 0.6, 0.6, z=foot[2] - robot.foot_radius)
    landing = FootholdTarget(Leg.LF, 0.1, 0.5, foot, UP, region)
    legs_down = np.array([[True] * 4, [False, True, True, True], [True] * 4])
    schedule, times = ContactSchedule(np.array([0.1, 0.5]), legs_down), np.array([0.0, 1.0])
    reference = WholeBodyReference(0.0, 1, times, np.tile(standing, (2, 1)), np.zeros((2, 24)), schedule, (landing,))
    pushed = replace(standing_state(robot, 0.0), v_WB=np.array([0.0, 0.6, 0.0]))
    mpc = RealTimeIteration(robot, MpcConfig(footholds=FootholdShiftConfig(max_shift=most)))
    policy = mpc.compute(pushed, reference, MpcMemory.empty()).policy
    np.testing.assert_allclose(policy.swings[Leg.LF][0].end_point, foot + np.array([0.0, aside, 0.0]), atol=1e-9)
