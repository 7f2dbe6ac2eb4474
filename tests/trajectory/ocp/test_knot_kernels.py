"""The quadratic model of the knots against the same by dense products, and as a program for every back-end."""

import numpy as np
import pytest

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.solvers.program_matrices import ProgramMatrices
from quadpips_drake.trajectory.centroidal.centroidal_derivatives import knot_derivatives
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.ocp.knot_kernels import approximate_knots, stage_cost
from quadpips_drake.trajectory.ocp.knot_values import evaluate_knots
from quadpips_drake.trajectory.ocp.optimal_control_problem import OcpConfig, OptimalControlProblem
from quadpips_drake.trajectory.ocp.reduction import unpacked
from tests.trajectory.centroidal.test_centroidal_model import random_points
from tests.trajectory.walking import trot_task

NUM_KNOTS = 8
TOLERANCE = 1e-11
"""Rounding of sums in another order, as part of the largest entry."""


@pytest.fixture(scope="module", params=[1, 3], ids=["bound along the normal", "bound in all directions"])
def case(request):
    """A problem that is linearised about wild states, with regions under the feet: (problem, task arrays, X, U)."""
    model = CentroidalModel(load_robot("anymal_c"))
    problem = OptimalControlProblem(model, OcpConfig(swing_constraint_directions=request.param), NUM_KNOTS)
    _, task = trot_task(model, NUM_KNOTS, horizon=0.8)
    task.stance[0] = True
    assert {2, 4} == set(task.stance.sum(axis=1))
    task.halfspace_normals, task.halfspace_offsets = np.zeros((NUM_KNOTS, 4, 2, 3)), np.zeros((NUM_KNOTS, 4, 2))
    task.halfspace_normals[:, :, 0] = [0.8, 0.6, 0.1]
    task.halfspace_offsets[:, :, 0] = 1.0
    states, inputs = random_points(model, NUM_KNOTS + 1, seed=5)
    arrays = task.arrays(0.5)
    approximate_knots(problem._parameters, arrays, states, inputs[:-1], problem._blocks)
    return problem, arrays, states, inputs[:-1]


def assert_close(ours, dense):
    np.testing.assert_allclose(ours, dense, rtol=0.0, atol=TOLERANCE * np.abs(dense).max())


def dense_map(blocks, k):
    """[dx; du] = offset + map z: (48,) and (48, 36)."""
    full = np.zeros((48, 36))
    full[:24, :24] = np.eye(24)
    full[24:36, 24:] = np.diag(blocks.force_scale[k])
    full[36:] = blocks.rate_map[k]
    return np.concatenate((np.zeros(24), blocks.input_change[k])), full


def test_dynamics_are_the_midpoint_rule(case):
    problem, task, states, inputs = case
    blocks, model = problem._blocks, problem.model
    for k, (x, u) in enumerate(zip(states[:-1], inputs, strict=True)):
        dt = task.times[k + 1] - task.times[k]
        f, a, b = (part[0] for part in model.linearize(x[None], u[None]))
        f_mid, a_mid, b_mid = (part[0] for part in model.linearize((x + 0.5 * dt * f)[None], u[None]))
        by_x, by_u = np.eye(24) + dt * a_mid @ (np.eye(24) + 0.5 * dt * a), dt * (b_mid + 0.5 * dt * a_mid @ b)
        offset, full = dense_map(blocks, k)
        assert_close(blocks.dynamics[k], np.hstack((by_x, by_u)) @ full)
        assert_close(blocks.defect[k], x + dt * f_mid - states[k + 1] + by_u @ offset[24:])


def test_cost_is_the_projected_one(case):
    problem, task, states, inputs = case
    parameters, blocks = problem._parameters, problem._blocks
    for k, (x, u) in enumerate(zip(states[:-1], inputs, strict=True)):
        arrays = [np.empty(s) for s in ((24,), (24, 24), (24, 24), (4, 3), (4, 3), (4, 3, 24), (4, 3, 24), (4, 3, 24))]
        geometry = knot_derivatives(parameters.tree, x, u, *arrays)
        hessian, linear, dt = np.zeros((48, 48)), np.zeros(48), task.times[k + 1] - task.times[k]
        cost = stage_cost(parameters, task, k, x, u, dt, tuple(arrays[3:]), geometry, hessian, linear)
        assert blocks.costs[k] == cost
        assert not hessian[24:36, 36:].any()  # what the elimination relies on
        offset, full = dense_map(blocks, k)
        dense = full.T @ hessian @ full
        dense[np.diag_indices(36)] += ~full.any(axis=0)
        assert_close(unpacked(blocks.hessian[k]), dense)
        assert_close(blocks.gradient[k], full.T @ (linear + hessian @ offset))


def test_values_without_derivatives_are_the_same(case):
    problem, task, states, inputs = case
    cost, violation = evaluate_knots(problem._parameters, task, states, inputs)
    assert cost == pytest.approx(problem._blocks.costs.sum(), rel=TOLERANCE)
    assert violation == pytest.approx(problem._blocks.violations.sum(), rel=TOLERANCE)


def test_the_program_says_what_the_matrices_say(case):
    problem, _, states, _ = case
    program = problem._program
    root = np.random.default_rng(1).normal(size=(24, 24))
    for shift in (0.0, 0.1):  # the second time it is updated
        program.update(shift - states[0], root @ root.T, root[0] + shift)
        program._update_program()
        ours, theirs = program.matrices, ProgramMatrices(program.prog)
        for name in ("P", "A", "G"):
            one, other = getattr(ours, name), getattr(theirs, name)
            np.testing.assert_array_equal(one.indptr, other.indptr)
            np.testing.assert_array_equal(one.indices, other.indices)
            np.testing.assert_array_equal(one.data, other.data)
        for name in ("c", "b", "h_l", "h_u", "x_l", "x_u"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))


def test_steps_lead_back_to_states_and_inputs(case):
    problem = case[0]
    solution = np.random.default_rng(2).normal(size=NUM_KNOTS * 36 + 24)
    state_steps, input_steps = problem._program.steps(solution)
    np.testing.assert_array_equal(state_steps[-1], solution[-24:])
    for k in range(NUM_KNOTS):
        z = solution[36 * k : 36 * (k + 1)]
        offset, full = dense_map(problem._blocks, k)
        np.testing.assert_allclose(np.concatenate((state_steps[k], input_steps[k])), offset + full @ z, atol=1e-9)
