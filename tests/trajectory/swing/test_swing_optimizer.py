"""From foothold plans to whole-body references."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.errors import UserInputError
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.penetration import sphere_depths
from quadpips_drake.terrain.terrain import Box, Terrain, pose
from quadpips_drake.timing import StageTimings
from quadpips_drake.trajectory.swing.ground_profile import KnownGround, region_halfspaces
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer, SwingOptimizerConfig
from quadpips_drake.trajectory.swing.swing_optimizer_system import SwingTrajectoryOptimizer
from quadpips_drake.trajectory.swing.target_configuration import TargetConfig, find_target, foot_centers
from quadpips_drake.values.centroidal import CentroidalInput
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, Stance
from quadpips_drake.values.regions import GroundHeights, PlanarRegion
from tests.trajectory.walking import robot_state_of, uneven_plan

STEPS = {"anymal_c": 0.2, "go2": 0.12}


@pytest.fixture(scope="module", params=["anymal_c", "go2"])
def optimizer(request):
    return SwingOptimizer(load_robot(request.param))


@pytest.fixture(scope="module")
def trot(optimizer):
    plan = uneven_plan(optimizer.robot, step=STEPS[optimizer.robot.name])
    return plan, optimizer.optimize(optimizer.model.nominal_state(), plan, stamp=3.0)


def test_all_swings_converge(trot):
    plan, result = trot
    assert result.success and not result.reason and result.refused is None
    assert [report.status for report in result.reports] == ["converged"] * len(plan.swing_legs)
    assert max(report.landing_error for report in result.reports) < 0.02
    assert result.elapsed > 0


def test_a_swing_that_would_miss_its_foothold_is_refused(optimizer):
    strict = SwingOptimizer(optimizer.robot, replace(optimizer.config, max_landing_error=1e-5))
    plan = uneven_plan(optimizer.robot, step=STEPS[optimizer.robot.name])
    result = strict.optimize(optimizer.model.nominal_state(), plan)
    assert not result.success and len(result.reference.times) == 0 and len(result.reports) == 1
    assert "swing 1 (RF+LH): a foot would land" in result.reason == result.refused.reason
    assert result.refused.legs == plan.swing_legs[0]
    np.testing.assert_array_equal(result.refused.start, plan.stances[0].footholds)
    np.testing.assert_array_equal(result.refused.end, plan.stances[1].footholds)


def test_the_plan_ends_at_rest_before_a_swing_that_fails(optimizer, trot, monkeypatch):
    plan, whole = trot
    verdict = SwingOptimizer._verdict
    third = plan.stances[3].footholds[plan.swing_legs[2][0]] + [0.0, 0.0, optimizer.robot.foot_radius]

    def refusing(self, solution, landing, heights):
        foot = self.model.foot_positions(solution.X[-1])[plan.swing_legs[2][0]]
        return "no" if np.linalg.norm(foot - third) < 0.02 else verdict(self, solution, landing, heights)

    monkeypatch.setattr(SwingOptimizer, "_verdict", refusing)
    result = optimizer.optimize(optimizer.model.nominal_state(), plan)
    assert result.refused.legs == plan.swing_legs[2] and result.reason.startswith("swing 3 ")
    np.testing.assert_array_equal(result.refused.end, plan.stances[3].footholds)
    assert [report.used for report in result.reports] == [True, True, False]
    reference = result.reference
    assert reference.end_time == pytest.approx(1.0) and len(reference.footholds) == 4
    assert np.abs(reference.states[-1, 0]) < 0.6 * np.abs(whole.reference.states[100, 0])  # where that one walks on


def test_one_clock(trot):
    plan, result = trot
    reference = result.reference
    assert reference.request_id == plan.request_id and reference.stamp == 3.0
    assert reference.times[0] == 0.0 and reference.end_time == pytest.approx(0.5 * len(plan.swing_legs))
    np.testing.assert_allclose(np.diff(reference.times), 0.01)
    assert reference.states.shape == reference.inputs.shape == (len(reference.times), 24)
    np.testing.assert_allclose(reference.schedule.event_times[:4], [0.05, 0.45, 0.55, 0.95])
    for k, legs in enumerate(plan.swing_legs):
        lifted = np.flatnonzero(~reference.schedule.at(0.5 * k + 0.25))
        assert set(lifted) == set(legs)
    assert reference.schedule.at(1e3).all()


def test_feet_land_where_planned_and_stay(optimizer, trot):
    plan, result = trot
    reference, model = result.reference, optimizer.model
    assert len(reference.footholds) == sum(len(legs) for legs in plan.swing_legs)
    for target in reference.footholds:
        landed = np.searchsorted(reference.times, target.touchdown_time + 0.03)
        foot = model.foot_positions(reference.states[landed])[target.leg]
        np.testing.assert_allclose(foot, target.position, atol=0.02)
    for k in range(len(reference.times) - 1):
        moved = model.foot_positions(reference.states[k + 1]) - model.foot_positions(reference.states[k])
        assert np.abs(moved[reference.schedule.at(reference.times[k] + 0.005)]).max() < 2e-3


def test_base_keeps_moving_between_swings(optimizer, trot):
    plan, result = trot
    at_seams = result.reference.states[[100, 150], 0]
    assert (at_seams > 0.5 * STEPS[optimizer.robot.name]).all()
    assert abs(result.reference.states[-1, 0]) < 0.1
    if optimizer.robot.name == "anymal_c":
        stopping = SwingOptimizer(optimizer.robot, SwingOptimizerConfig(carry_momentum=False))
        stopped = stopping.optimize(optimizer.model.nominal_state(), plan)
        assert stopped.success
        assert (stopped.reference.states[[100, 150], 0] < at_seams).all()


def test_refinement_removes_jumps_between_swings(optimizer, trot):
    plan, refined = trot
    rough = SwingOptimizer(optimizer.robot, SwingOptimizerConfig(refinement_iterations=0))
    rough = rough.optimize(optimizer.model.nominal_state(), plan)
    assert refined.refined and not rough.refined
    seams = 50 * np.arange(1, len(plan.swing_legs))

    def largest_jump(inputs):
        return np.abs(inputs[seams, CentroidalInput.FORCES] - inputs[seams - 1, CentroidalInput.FORCES]).max()

    assert largest_jump(refined.reference.inputs) < 0.1 * largest_jump(rough.reference.inputs)


def test_walk_moves_one_leg_at_a_time(optimizer):
    order = ((Leg.LH,), (Leg.LF,), (Leg.RH,), (Leg.RF,))
    plan = uneven_plan(optimizer.robot, swings=4, step=0.1, legs=order)
    result = optimizer.optimize(optimizer.model.nominal_state(), plan)
    assert result.success and not result.reason
    assert (~result.reference.schedule.stance).sum(axis=1).max() == 1


def test_foothold_out_of_reach_ends_the_plan_before_it(optimizer):
    plan = uneven_plan(optimizer.robot, swings=2, step=STEPS[optimizer.robot.name])
    last = plan.stances[-1]
    feet = last.footholds.copy()
    feet[Leg.LF] += [1.5, 0.0, 0.0]
    bad = Stance(feet, last.normals, last.regions, last.p_WB, last.rpy_WB)
    plan = replace(plan, stances=(*plan.stances[:-1], bad))
    result = optimizer.optimize(optimizer.model.nominal_state(), plan)
    assert result.success and len(result.reports) == 1
    assert "swing 2 (LF+RH): no configuration reaches with LF" in result.reason
    assert result.refused.legs == plan.swing_legs[1]
    np.testing.assert_array_equal(result.refused.end, bad.footholds)


def test_plan_without_stances_gives_no_samples(optimizer):
    result = optimizer.optimize(optimizer.model.nominal_state(), FootholdPlan(0.0, 7, reason="no way"))
    assert not result.success and result.reason == "no way" and result.reference.request_id == 7


def wall_across(robot, plan, height):
    """Heights of level ground with a wall, 4 cm thick, in the middle of the way of the plan's first swinging foot."""
    leg, cell = plan.swing_legs[0][0], 0.01
    middle = 0.5 * (plan.stances[0].footholds[leg, 0] + plan.stances[1].footholds[leg, 0])
    x = np.arange(-1.0, 1.0, cell) + 0.5 * cell
    heights = np.zeros((len(x), 200), dtype=np.float32)
    heights[np.abs(x - middle) < 0.02] = height
    return KnownGround((), GroundHeights(0.0, np.array([-1.0, -1.0]), cell, heights))


@pytest.mark.parametrize("height", [0.12, 0.18])
def test_a_swing_clears_a_wall_and_lands_on_its_foothold(height):
    robot = load_robot("anymal_c")
    optimizer, plan = SwingOptimizer(robot), uneven_plan(robot, swings=1, step=0.4, legs=((Leg.LF,),))
    ground = wall_across(robot, plan, height)
    result = optimizer.optimize(optimizer.model.nominal_state(), plan, ground=ground)
    assert result.success and result.reports[0].landing_error < 0.02
    wall = Box(X_WE=pose((plan.stances[0].footholds[Leg.LF, 0] + 0.1, 0.0, 0.5 * height)), size=[0.04, 2.0, height])
    feet = np.array([optimizer.model.foot_positions(x)[Leg.LF] for x in result.reference.states])
    terrain = Terrain("wall", np.zeros(3), np.array([1.0, 0.0]), 1.0, (wall,))
    assert sphere_depths(terrain, feet, robot.foot_radius).max() < 0.01


def test_a_swing_that_cannot_clear_a_wall_is_refused():
    robot = load_robot("anymal_c")
    optimizer, plan = SwingOptimizer(robot), uneven_plan(robot, swings=1, step=0.4, legs=((Leg.LF,),))
    result = optimizer.optimize(optimizer.model.nominal_state(), plan, ground=wall_across(robot, plan, 0.4))
    assert not result.success and "cm of ground" in result.refused.reason


def test_failed_optimisation_leaves_no_motion():
    robot = load_robot("anymal_c")
    config = SwingOptimizerConfig(max_iterations=1, max_violation=0.0, tolerance=1e-12)
    optimizer = SwingOptimizer(robot, config)
    result = optimizer.optimize(optimizer.model.nominal_state(), uneven_plan(robot, swings=2))
    assert not result.success and not result.reports[0].used
    assert "swing 1 (RF+LH): optimisation failed" in result.reason


def test_target_is_sampled_when_the_nominal_pose_does_not_reach():
    robot = load_robot("anymal_c")
    feet = foot_centers(uneven_plan(robot).stances[0], robot.foot_radius)
    rpy, nominal = np.zeros(3), np.array([0.0, 0.0, robot.nominal_base_height])
    straight = find_target(robot, nominal, rpy, feet, TargetConfig())
    assert straight.reached
    np.testing.assert_allclose(straight.joints, robot.nominal_joints, atol=1e-2)
    high = nominal + np.array([0.0, 0.0, 0.09])
    config = TargetConfig(vertical_range=0.12)
    assert not find_target(robot, high, rpy, feet, TargetConfig(samples=1)).reached
    found = find_target(robot, high, rpy, feet, config)
    assert found.reached and found.p_WB[2] < high[2]
    again = find_target(robot, high, rpy, feet, config)
    np.testing.assert_array_equal(found.p_WB, again.p_WB)


def test_region_halfspaces_hold_inside_the_region_only():
    c, s = np.cos(0.3), np.sin(0.3)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]], [1.0, 2.0, 0.5]
    square = np.array([[-0.1, -0.2], [0.1, -0.2], [0.1, 0.2], [-0.1, 0.2]])
    normals, offsets = region_halfspaces(PlanarRegion(0, pose, square, square))

    def distances(x, y, z=0.05):
        return normals @ (pose[:3, :3] @ [x, y, z] + pose[:3, 3]) + offsets

    np.testing.assert_allclose(sorted(distances(0, 0)), [0.1, 0.1, 0.2, 0.2])
    assert distances(0.11, 0).min() < 0


def test_system_plans_once_for_each_request():
    robot, timings = load_robot("anymal_c"), StageTimings()
    system = SwingTrajectoryOptimizer(robot, timings=timings)
    x0 = SwingOptimizer(robot).model.nominal_state()
    context = system.CreateDefaultContext()
    system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(robot_state_of(None, x0)))
    plan = uneven_plan(robot, swings=1)
    system.GetInputPort("foothold_plan").FixValue(context, AbstractValue.Make(FootholdPlan(0.0, 0)))
    simulator = Simulator(system, context)

    def reference_at(time):
        simulator.AdvanceTo(time)
        return system.GetOutputPort("reference").Eval(context)

    assert len(reference_at(0.03).times) == 0
    system.GetInputPort("foothold_plan").FixValue(context, AbstractValue.Make(plan))
    first = reference_at(0.05)
    assert first.request_id == 1 and len(first.times) == 51
    assert system.GetOutputPort("status").Eval(context).ok
    assert system.GetOutputPort("swing_plan").Eval(context).reference is first
    assert reference_at(0.1) is first
    assert timings.summary_ms()["swing"]["n"] == 1


def test_bad_configuration():
    with pytest.raises(UserInputError, match="samples"):
        TargetConfig(samples=0)
    with pytest.raises(UserInputError, match="time_step"):
        SwingOptimizerConfig(time_step=0.0)


def test_a_swing_whose_torso_sets_a_knee_on_the_ground_is_refused():
    optimizer = SwingOptimizer(load_robot("go2"))
    plan, start = uneven_plan(optimizer.robot, step=STEPS["go2"], swings=1), optimizer.model.nominal_state()
    x = optimizer.optimize(start, plan).reference.states[-1]
    stands = next(leg for leg in Leg if leg not in plan.swing_legs[0])
    knee = x[6:9] + rotation_from_rpy(x[9:12]) @ optimizer.robot.link_poses_B(x[12:])[1][3 * stands + 3]
    heights = np.full((9, 9), np.nan, np.float32)
    heights[3:6, 3:6] = knee[2] - 0.005
    tower = GroundHeights(0.0, knee[:2] - 0.045, 0.01, heights)
    low = replace(tower, height=heights - np.float32(0.15))
    lenient = SwingOptimizer(optimizer.robot, replace(optimizer.config, thigh_clearance=-1.0))
    refused = optimizer.optimize(start, plan, ground=KnownGround((), tower))
    assert not refused.success and f"the {stands.name} knee" in refused.reason
    assert optimizer.optimize(start, plan, ground=KnownGround((), low)).success
    assert lenient.optimize(start, plan, ground=KnownGround((), tower)).success
