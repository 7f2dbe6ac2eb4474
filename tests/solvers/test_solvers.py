"""All back-ends must agree on the same programs, also after the coefficients changed."""

import subprocess
import sys

import numpy as np
import pytest
from pydrake.solvers import MathematicalProgram, MathematicalProgramResult, SolutionResult, SolverOptions

from quadpips_drake.errors import UserInputError
from quadpips_drake.solvers.piqp_solver import PiqpSolver
from quadpips_drake.solvers.program_matrices import ProgramMatrices
from quadpips_drake.solvers.proxqp_solver import ProxQpSolver
from quadpips_drake.solvers.registry import make_solver, solve_program, solver_names

OWN_SOLVERS = [PiqpSolver("sparse_multistage"), PiqpSolver("sparse_ldlt"), PiqpSolver("dense_cholesky"), ProxQpSolver()]


class RandomProgram:
    """A feasible convex program with every kind of cost and constraint, overlapping variables and changing data."""

    def __init__(self, seed, num_vars=24):
        self.rng = np.random.default_rng(seed)
        self.prog = MathematicalProgram()
        self.x = self.prog.NewContinuousVariables(num_vars)
        n = num_vars
        self.cost_vars = (self.x[: 2 * n // 3], self.x[n // 3 :][::-1])
        self.costs = [self.prog.AddQuadraticCost(np.eye(len(v)), np.zeros(len(v)), v) for v in self.cost_vars]
        self.linear_cost = self.prog.AddLinearCost(np.zeros(5), 0.0, self.x[5:10])
        self.equality = self.prog.AddLinearEqualityConstraint(np.ones((4, n)), np.zeros(4), self.x)
        self.inequality = self.prog.AddLinearConstraint(np.ones((6, n // 2)), -np.ones(6), np.ones(6), self.x[n // 2 :])
        self.prog.AddBoundingBoxConstraint(-2.0, 2.0, self.x[: n // 2])
        self.prog.AddBoundingBoxConstraint(-1.0, 3.0, self.x[:4])
        self.prog.AddBoundingBoxConstraint(0.3, 0.3, self.x[1])
        self.randomise()

    def randomise(self):
        rng, n = self.rng, len(self.x)
        for cost, v in zip(self.costs, self.cost_vars, strict=True):
            root = rng.normal(size=(len(v), len(v)))
            cost.evaluator().UpdateCoefficients(root @ root.T + 0.1 * np.eye(len(v)), rng.normal(size=len(v)))
        self.linear_cost.evaluator().UpdateCoefficients(rng.normal(size=5))
        feasible = rng.uniform(-0.5, 0.5, n)
        feasible[1] = 0.3
        matrix = rng.normal(size=(4, n))
        self.equality.evaluator().UpdateCoefficients(matrix, matrix @ feasible)
        matrix = rng.normal(size=(6, n // 2))
        middle = matrix @ feasible[n // 2 :]
        upper = middle + rng.uniform(0.01, 0.3, 6)
        upper[0] = np.inf
        lower = middle - rng.uniform(0.01, 0.3, 6)
        lower[1] = upper[1] = middle[1]
        self.inequality.evaluator().UpdateCoefficients(matrix, lower, upper)


def reference_solution(prog):
    x, details = solve_program(make_solver("clarabel"), prog)
    assert details.success
    return x


@pytest.mark.parametrize("name", [name for name in solver_names() if name != "failing"])
def test_all_back_ends_agree_and_follow_updates(name):
    problem, solver = RandomProgram(seed=3), make_solver(name)
    tolerance = 2e-3 if name == "osqp" else 1e-4
    for _ in range(3):
        x, details = solve_program(solver, problem.prog)
        assert details.success
        assert details.iterations > 0
        np.testing.assert_allclose(x, reference_solution(problem.prog), atol=tolerance)
        problem.randomise()


@pytest.mark.parametrize("solver", OWN_SOLVERS, ids=lambda s: s.solver_id().name())
def test_drake_interface(solver):
    problem = RandomProgram(seed=5)
    result = MathematicalProgramResult()
    solver.Solve(problem.prog, None, SolverOptions(), result)
    assert result.is_success()
    np.testing.assert_allclose(result.GetSolution(problem.x), reference_solution(problem.prog), atol=1e-4)
    assert solver.AreProgramAttributesSatisfied(problem.prog)
    returned = solver.Solve(problem.prog)
    assert returned.is_success()
    np.testing.assert_array_equal(returned.GetSolution(problem.x), result.GetSolution(problem.x))
    problem.prog.AddCost(lambda z: z[0] ** 4, vars=problem.x[:1])
    assert not solver.AreProgramAttributesSatisfied(problem.prog)
    assert "quadratic" in solver.ExplainUnsatisfiedProgramAttributes(problem.prog)


@pytest.mark.parametrize("solver", OWN_SOLVERS, ids=lambda s: s.solver_id().name())
def test_infeasible_program_is_reported(solver):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), x)
    prog.AddLinearConstraint(np.array([[1.0, 1.0]]), [3.0], [4.0], x)
    prog.AddBoundingBoxConstraint(-1.0, 1.0, x)
    value, details = solver.solve_program(prog)
    assert not details.success
    assert np.isnan(value).all()
    result = MathematicalProgramResult()
    solver.Solve(prog, None, None, result)
    assert result.get_solution_result() != SolutionResult.kSolutionFound


def test_solver_options_reach_the_solver():
    problem, solver, options = RandomProgram(seed=1), PiqpSolver(), SolverOptions()
    options.SetOption(solver.solver_id(), "max_iter", 1)
    result = MathematicalProgramResult()
    solver.Solve(problem.prog, None, options, result)
    assert result.get_solution_result() == SolutionResult.kIterationLimit


@pytest.mark.parametrize("kind", ["sparse_multistage", "sparse_ldlt", "dense_cholesky", "proxqp"])
def test_answer_does_not_depend_on_earlier_solves(kind):
    def make():
        return ProxQpSolver() if kind == "proxqp" else PiqpSolver(kind)

    problem, used = RandomProgram(seed=7), make()
    used.solve_program(problem.prog)
    problem.randomise()
    x_used, _ = used.solve_program(problem.prog)
    x_fresh, _ = make().solve_program(problem.prog)
    np.testing.assert_array_equal(x_used, x_fresh)


def test_a_solver_that_fails_on_purpose():
    problem = RandomProgram(seed=1)
    x, details = solve_program(make_solver("failing"), problem.prog)
    assert not details.success and np.isnan(x).all()
    assert not make_solver("failing").Solve(problem.prog).is_success()


@pytest.mark.parametrize("rounds", [0, 1, 10])
def test_equilibration_does_not_move_the_answer(rounds):
    problem = RandomProgram(seed=9)
    x, details = PiqpSolver("sparse_ldlt", equilibration_rounds=rounds).solve_program(problem.prog)
    assert details.success
    np.testing.assert_allclose(x, reference_solution(problem.prog), atol=1e-4)


def test_matrices_keep_their_pattern_and_give_the_cost():
    problem = RandomProgram(seed=2)
    matrices = ProgramMatrices(problem.prog)
    pattern = matrices.A.indices.copy()
    problem.randomise()
    assert not matrices.refill()
    np.testing.assert_array_equal(matrices.A.indices, pattern)
    x = np.linspace(-1, 1, problem.prog.num_vars())
    expected = sum(float(problem.prog.EvalBinding(c, x)[0]) for c in problem.prog.GetAllCosts())
    assert matrices.cost(x) == pytest.approx(expected)


def test_repeated_variables_add_up():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddQuadraticCost(np.array([[3.0, 1.0], [1.0, 2.0]]), np.array([-7.0, 0.0]), [x[0], x[0]])
    prog.AddQuadraticCost(np.eye(1), np.zeros(1), x[1:])
    value, _ = make_solver("piqp_ldlt").solve_program(prog)
    np.testing.assert_allclose(value, [1.0, 0.0], atol=1e-6)


def test_unknown_solver_lists_the_known_ones():
    with pytest.raises(UserInputError, match=r"unknown solver 'magic'; known: .*piqp"):
        make_solver("magic")


def test_without_proxsuite_everything_else_works():
    code = """
import dataclasses, sys
sys.modules["proxsuite"] = None  # its import fails
import quadpips_drake.diagrams.walk
from quadpips_drake.cli import doctor
from quadpips_drake.control.whole_body.whole_body_qp import make_whole_body_qp
from quadpips_drake.errors import UserInputError
make_whole_body_qp("piqp_direct", 2, 1, 1)
for check in doctor.checks():
    if check.name.startswith("solver"):
        check = dataclasses.replace(check, isolated=False)
        print(check.name, doctor.outcome(check)[0])
for name in ("proxqp", "proxqp_dense"):
    try:
        make_whole_body_qp(name, 2, 1, 1)
    except UserInputError as error:
        print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    lines = done.stdout.splitlines()
    assert lines[:4] == ["solver PIQP OK", "solver ProxQP NOTE", "solver OSQP OK", "solver Clarabel OK"], done.stderr
    assert [line.split(" (")[0] for line in lines[4:]] == [
        "the solver 'proxqp' is not installed",
        "the solver 'proxqp_dense' is not installed",
    ]
