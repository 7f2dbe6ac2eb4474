"""The optimal control problem as a whole: what it solves holds, on any grid, at any heading, with any back-end."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.ocp.optimal_control_problem import OcpConfig, OptimalControlProblem, shift_guess
from quadpips_drake.trajectory.ocp.tracking_task import TrackingTask
from quadpips_drake.values.centroidal import CentroidalInput as Input
from quadpips_drake.values.centroidal import CentroidalState as State
from quadpips_drake.values.centroidal import foot_forces
from tests.trajectory.walking import trot_task

NUM_KNOTS = 20


@pytest.fixture(scope="module", params=["anymal_c", "go2"])
def model(request):
    return CentroidalModel(load_robot(request.param))


@pytest.fixture(scope="module")
def problem(model):
    return OptimalControlProblem(model, OcpConfig(), NUM_KNOTS)


@pytest.fixture(scope="module")
def solved(model, problem):
    x0, task = trot_task(model, NUM_KNOTS)
    return x0, task, problem.solve(x0, task, tol=1e-6)


def test_converges(solved):
    x0, _, solution = solved
    assert solution.success and solution.status == "converged"
    assert solution.iterations <= 12
    assert solution.constraint_violation < 1e-5
    np.testing.assert_allclose(solution.X[0], x0, atol=1e-12)


def test_states_follow_the_dynamics(model, solved):
    _, task, solution = solved
    for k, dt in enumerate(np.diff(task.times)):
        x, u = solution.X[k], solution.U[k]
        middle = x + 0.5 * dt * model.dynamics(x, u)
        np.testing.assert_allclose(x + dt * model.dynamics(middle, u), solution.X[k + 1], atol=1e-5)


def test_contacts_are_respected(model, problem, solved):
    _, task, solution = solved
    velocity = model.feet(solution.X[:-1], solution.U)[1]
    position = model.feet(solution.X[:-1], solution.U)[0]
    forces = foot_forces(solution.U)
    np.testing.assert_allclose(forces[~task.stance], 0, atol=1e-6)
    drift = velocity + problem.config.stance_position_gain * (position - task.foot_ref_p[:-1])
    np.testing.assert_allclose(drift[task.stance], 0, atol=1e-4)
    tangential, tolerance = np.linalg.norm(forces[..., :2], axis=-1), 1e-4 * model.mass * GRAVITY
    assert (tangential <= problem.config.friction * forces[..., 2] + tolerance).all()


def test_robot_moves_as_asked(model, solved):
    _, task, solution = solved
    np.testing.assert_allclose(solution.X[-1, State.POSITION], task.x_ref[-1, State.POSITION], atol=0.06)
    assert np.abs(solution.X[:, State.ORIENTATION]).max() < 0.15
    positions = np.array([model.foot_positions(x) for x in solution.X])
    swing = ~task.stance
    error = np.abs(positions[:-1] - task.foot_ref_p[:-1])[swing]
    assert error[:, 2].max() < 0.025  # bound to the spline along the normal, by cost alone along the ground
    assert error[:, :2].max() < 0.12


def test_result_does_not_depend_on_heading(model, problem, solved):
    x0, task = trot_task(model, NUM_KNOTS, yaw=2.0)
    solution = problem.solve(x0, task, tol=1e-6)
    straight = solved[2]
    np.testing.assert_allclose(solution.X[:, State.JOINTS], straight.X[:, State.JOINTS], atol=5e-3)
    np.testing.assert_allclose(solution.X[:, 11] - 2.0, straight.X[:, 11], atol=2e-3)
    assert solution.cost == pytest.approx(straight.cost, rel=0.02)


def test_whole_turns_of_yaw_do_not_matter(model, problem, solved):
    x0, task, straight = solved
    turned = x0.copy()
    turned[11] += 2 * np.pi
    np.testing.assert_allclose(problem.solve(turned, task, tol=1e-6).X, straight.X, atol=1e-9)


def test_real_time_iterations_recover_from_a_push(model, problem, solved):
    x0, task, solution = solved
    pushed = x0.copy()
    pushed[1] += 0.25
    pushed[7] += 0.01
    guess, violations = solution, []
    for _ in range(5):
        guess = problem.iterate(pushed, task, guess)
        assert guess.success
        violations.append(guess.constraint_violation)
    assert violations[-1] < 0.1 * max(violations)
    np.testing.assert_allclose(guess.X[0], pushed, atol=1e-8)


def test_same_arguments_same_result(model, problem, solved):
    x0, task, solution = solved
    first = problem.iterate(x0, task, solution)
    problem.iterate(x0 + 0.01, task, None)
    again = problem.iterate(x0, task, solution)
    np.testing.assert_array_equal(again.X, first.X)
    np.testing.assert_array_equal(again.U, first.U)
    assert (first.X is not solution.X) and np.array_equal(first.times, task.times)


@pytest.mark.parametrize("solver", ["piqp_ldlt", "clarabel", "osqp"])
def test_back_ends_agree(model, problem, solver):
    if model.robot.name != "anymal_c":
        pytest.skip("one robot is enough")
    x0, task = trot_task(model, NUM_KNOTS)
    expected = problem.iterate(x0, task)
    other = OptimalControlProblem(model, OcpConfig(solver=solver), NUM_KNOTS).iterate(x0, task)
    assert other.success
    np.testing.assert_allclose(other.X, expected.X, atol=0.02 if solver == "osqp" else 1e-3)


def test_graded_grid_and_shifted_guess(model):
    x0, fine = trot_task(model, 24)
    times = np.concatenate((np.arange(0, 0.24, 0.02), np.linspace(0.24, 1.0, 11)))
    pick = np.clip(np.searchsorted(fine.times, times), 0, 24)
    stance = fine.stance[np.clip(pick[:-1], 0, 23)]
    task = TrackingTask(
        times,
        fine.x_ref[pick],
        np.array([model.gravity_compensation(flags) for flags in stance]),
        stance,
        fine.foot_ref_p[pick],
        fine.foot_ref_v[pick],
        fine.surface_normal[: len(times) - 1],
    )
    problem = OptimalControlProblem(model, OcpConfig(), task.num_knots)
    solution = problem.solve(x0, task)
    assert solution.success
    later = shift_guess(solution, times + 0.02)
    np.testing.assert_allclose(later.X[0], solution.X[1], atol=1e-9)
    np.testing.assert_array_equal(later.U[0], solution.U[1])
    np.testing.assert_array_equal(later.X[-1], solution.X[-1])
    assert problem.iterate(x0, task, later).success


def test_foothold_regions_hold_back_a_foot(model, problem):
    if model.robot.name != "anymal_c":
        pytest.skip("one robot is enough")
    x0, task = trot_task(model, NUM_KNOTS)
    edge = task.foot_ref_p[-1, 0, 0] - 0.03
    task.halfspace_normals, task.halfspace_offsets = np.zeros((NUM_KNOTS, 4, 1, 3)), np.zeros((NUM_KNOTS, 4, 1))
    task.halfspace_normals[:, 0, 0, 0], task.halfspace_offsets[:, 0, 0] = -1.0, edge
    free = problem.solve(x0, trot_task(model, NUM_KNOTS)[1])
    held = problem.solve(x0, task)
    assert held.success
    assert model.foot_positions(held.X[-1])[0, 0] < model.foot_positions(free.X[-1])[0, 0] - 0.005


@pytest.mark.parametrize("limit", ["position_lower", "velocity_limits", "torque_limits"])
def test_joint_limits_hold_back(model, limit):
    if model.robot.name != "anymal_c":
        pytest.skip("one robot is enough")
    x0, task = trot_task(model, NUM_KNOTS)
    problem = OptimalControlProblem(model, OcpConfig(), NUM_KNOTS)

    def extremes(solution):
        torques = -np.einsum(
            "nlij,nli->nlj",
            np.array([model.robot.foot_jacobians_B(x[State.JOINTS]) for x in solution.X[:-1]]),
            foot_forces(solution.U),
        )  # the base stays level in this task
        rates, joints = (
            np.abs(solution.U[:, Input.JOINT_VELOCITIES]).max(axis=0),
            solution.X[:, State.JOINTS].min(axis=0),
        )
        return {"position_lower": joints, "velocity_limits": rates, "torque_limits": np.abs(torques).max(axis=(0, 1))}[limit]

    free = extremes(problem.solve(x0, task))
    tight = free + 0.05 if limit == "position_lower" else np.resize(0.8 * free, 12)
    limits = {
        "position_lower": {"position_lower": np.minimum(tight, x0[State.JOINTS] - 0.02)},
        "velocity_limits": {"velocity_lower": -tight, "velocity_upper": tight},
        "torque_limits": {"torque_limits": tight},
    }
    problem._parameters = problem._parameters._replace(**limits[limit])
    held = extremes(problem.solve(x0, task))
    moved = held - free if limit == "position_lower" else free - held
    assert moved.max() > 0.04 * np.abs(free).max()
    assert moved.min() > -0.1 * np.abs(free).max()


def test_single_rigid_body_by_one_switch(model):
    x0, task = trot_task(model, NUM_KNOTS)
    config = OcpConfig(model="single_rigid_body")
    solution = OptimalControlProblem(CentroidalModel(model.robot, config.model), config, NUM_KNOTS).solve(x0, task)
    assert solution.success
    np.testing.assert_allclose(solution.X[-1, State.POSITION], task.x_ref[-1, State.POSITION], atol=0.06)


def test_bad_input():
    with pytest.raises(UserInputError, match="friction"):
        OcpConfig(friction=-1.0)
    with pytest.raises(UserInputError, match="swing_constraint_directions must be 1 or 3"):
        OcpConfig(swing_constraint_directions=2)


def test_swing_feet_bound_in_all_directions(model):
    x0, task = trot_task(model, NUM_KNOTS)
    problem = OptimalControlProblem(model, OcpConfig(swing_constraint_directions=3), NUM_KNOTS)
    solution = problem.solve(x0, task)
    assert solution.success
    velocity, position = model.feet(solution.X[:-1], solution.U)[1::-1]
    gain = problem.config.swing_error_gain
    error = velocity - task.foot_ref_v[:-1] + gain * (position - task.foot_ref_p[:-1])
    np.testing.assert_allclose(error[~task.stance], 0, atol=1e-2)
