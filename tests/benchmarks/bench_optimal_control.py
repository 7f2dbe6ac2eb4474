"""How long one real-time iteration of the optimal control problem takes, by back-end and number of knots, and a swing.

Not part of the tests; run with

    OPENBLAS_NUM_THREADS=1 pytest tests/benchmarks/bench_optimal_control.py --benchmark-columns=min,median,rounds

The columns linearisation, assembly, qp of the printed table say where the time goes (medians, in ms). OSQP and Clarabel are
what a user of Drake would pick instead.
"""

import numpy as np
import pytest

from quadpips_drake.robots.robot_model import load_robot
from quadpips_drake.trajectory.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.optimal_control_problem import OcpConfig, OptimalControlProblem
from quadpips_drake.trajectory.swing_optimizer import SwingOptimizer
from tests.trajectory.walking import trot_task, uneven_plan

SOLVERS = ["piqp", "piqp_ldlt", "proxqp", "osqp", "clarabel"]
_rows = []


@pytest.fixture(scope="module")
def model():
    return CentroidalModel(load_robot("anymal_c"))


@pytest.fixture(scope="module", autouse=True)
def table():
    yield
    print("\n\n knots  solver       total  linearisation  assembly     qp   (medians, ms)")
    for knots, solver, *times in _rows:
        print(f"{knots:6d}  {solver:10s}{times[0]:8.2f}{times[1]:15.2f}{times[2]:10.2f}{times[3]:7.2f}")


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("knots", [20, 22, 33, 67])
def test_real_time_iteration(benchmark, model, knots, solver):
    benchmark.group = f"one iteration, {knots} knots"
    problem = OptimalControlProblem(model, OcpConfig(solver=solver), knots)
    x0, task = trot_task(model, knots)
    guess = OptimalControlProblem(model, OcpConfig(), knots).solve(x0, task)
    x0[1] += 0.1
    problem.iterate(x0, task, guess)
    solutions = []

    def iterate():
        solutions.append(problem.iterate(x0, task, guess))

    benchmark.pedantic(iterate, rounds=30 if solver == "piqp" else 5)
    assert all(solution.success for solution in solutions)
    parts = [(s.solve_time, s.linearisation_time, s.assembly_time, s.qp_time) for s in solutions]
    _rows.append((knots, solver, *(1e3 * np.median(parts, axis=0))))


def test_linearisation(benchmark, model):
    benchmark.group = "model"
    _, task = trot_task(model, 22)
    model.linearize(task.x_ref[:-1], task.u_ref)
    benchmark(model.linearize, task.x_ref[:-1], task.u_ref)


def test_plan_of_four_swings(benchmark):
    benchmark.group = "swings"
    robot = load_robot("anymal_c")
    optimizer, plan = SwingOptimizer(robot), uneven_plan(robot)
    x0 = optimizer.model.nominal_state()
    optimizer.optimize(x0, plan)
    result = benchmark.pedantic(optimizer.optimize, args=(x0, plan), rounds=5)
    assert not result.reason
