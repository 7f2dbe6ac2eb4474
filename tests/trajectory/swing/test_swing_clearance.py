"""Swings over barriers, by geometry alone, held against what the optimiser refuses."""

import numpy as np
import pytest

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trajectory.swing.ground_profile import KnownGround
from quadpips_drake.trajectory.swing.swing_clearance import SwingClearance
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer, SwingOptimizerConfig
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, Stance
from quadpips_drake.values.regions import GroundHeights, RegionSet

ROBOT = load_robot("anymal_c")
DURATION = 0.4
WALL = 0.55
"""Where it begins [m]; it is 8 cm thick."""


def heights(wall):
    """Level ground with a wall across it, ``wall`` [m] high."""
    height = np.zeros((200, 200), np.float32)
    begin = round((WALL + 1.0) / 0.01)
    height[begin : begin + 8] = wall
    return GroundHeights(0.0, np.array([-1.0, -1.0]), 0.01, height)


def stance(forward=0.0):
    """Nominal on level ground with LF moved ``forward`` [m]; the base follows a quarter of the way."""
    feet = ROBOT.nominal_footholds_B + np.array([0.0, 0.0, ROBOT.nominal_base_height - ROBOT.foot_radius])
    feet[Leg.LF, 0] += forward
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    return Stance(feet, normals, (None,) * 4, np.array([0.25 * forward, 0.0, ROBOT.nominal_base_height]), np.zeros(3))


def ends(a, b, leg=Leg.LF):
    return (a.footholds[leg], a.normals[leg]), (b.footholds[leg], b.normals[leg])


@pytest.mark.parametrize(
    ("wall", "before", "clear"), [(0.0, 0.045, True), (0.12, 0.045, False), (0.12, 0.12, True), (0.45, 0.12, False)]
)
def test_a_foot_at_the_foot_of_a_wall_does_not_get_over_it(wall, before, clear):
    distance = WALL - before - stance().footholds[Leg.LF, 0]
    start, end = stance(distance), stance(distance + before + 0.25)
    test = SwingClearance.over(RegionSet.empty(), heights(wall), ROBOT.foot_radius, SwingOptimizerConfig())
    assert test(DURATION, *ends(start, end)) == clear


def test_it_grants_what_the_optimiser_does_not_refuse_for_the_ground():
    """40 swings of a foot over a wall of 12 cm."""
    optimizer, rng, ground = SwingOptimizer(ROBOT), np.random.default_rng(3), heights(0.12)
    test = SwingClearance.over(RegionSet.empty(), ground, ROBOT.foot_radius, optimizer.config)
    verdicts = []
    for _ in range(40):
        before = rng.uniform(-0.1, 0.1)
        start, end = stance(before), stance(before + rng.uniform(0.1, 0.35))
        state = np.array(optimizer.model.nominal_state())
        state[CentroidalState.POSITION] = start.p_WB
        centers = start.footholds + ROBOT.foot_radius * start.normals - start.p_WB
        joints = [ROBOT.leg_inverse_kinematics_B(leg, centers[leg])[0] for leg in Leg]
        state[CentroidalState.JOINTS] = np.concatenate(joints)
        plan = FootholdPlan(0.0, 1, (start, end), ((Leg.LF,),), "", DURATION, 0.1)
        refused = optimizer.optimize(state, plan, ground=KnownGround((), ground)).reason
        verdicts.append((test(DURATION, *ends(start, end)), "cm of ground" not in refused))
    granted, optimised = np.array(verdicts).T
    assert 5 < granted.sum() < 35, "the test needs both"
    np.testing.assert_array_equal(granted, optimised)
