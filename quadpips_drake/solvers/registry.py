"""Solvers by name, so that one configuration key chooses the back-end of any problem."""

import time
from functools import partial

import numpy as np
from pydrake.solvers import ClarabelSolver, OsqpSolver, SolverId, SolverOptions

from quadpips_drake.framework.registry import Registry
from quadpips_drake.solvers.missing_solver import needed_for
from quadpips_drake.solvers.qp_solver import QpSolver, SolveDetails

qp_solvers = Registry("solver", "quadpips_drake.qp_solvers")
"""Back-ends for quadratic programs: ``factory(tolerance)`` returns a pydrake SolverInterface; for ``tolerance`` see
``make_solver``. Each is imported when it is asked for, so that a missing one is missed by nobody else."""


def _piqp(method: str, tolerance: float | None):
    from quadpips_drake.solvers.piqp_solver import PiqpSolver

    return PiqpSolver(method, **_piqp_settings(tolerance))


def _proxqp(tolerance: float | None):
    from quadpips_drake.solvers.proxqp_solver import ProxQpSolver

    return ProxQpSolver(**({} if tolerance is None else {"eps_abs": tolerance}))


qp_solvers.add("piqp", partial(_piqp, "sparse_multistage"), summary="PIQP, which knows that knots follow one another")
qp_solvers.add("piqp_ldlt", partial(_piqp, "sparse_ldlt"), summary="PIQP, sparse")
qp_solvers.add("piqp_dense", partial(_piqp, "dense_cholesky"), summary="PIQP, dense")
qp_solvers.add("proxqp", _proxqp, summary="ProxQP, dense")
qp_solvers.add("osqp", lambda tolerance: OsqpSolver(), summary="OSQP as it comes with Drake")
qp_solvers.add("clarabel", lambda tolerance: ClarabelSolver(), summary="Clarabel as it comes with Drake")


def _piqp_settings(tolerance):
    if tolerance is None:
        return {}
    # Two rounds of equilibration do as well as ten on our problems, and a smaller proximal term and a longer step to the
    # boundary save one or two of seven iterations.
    settings = {"equilibration_rounds": 2, "delta_init": 1e-6, "tau": 0.995, "check_duality_gap": False}
    return {"eps_abs": tolerance, "eps_rel": tolerance, **settings}


def solver_names() -> list[str]:
    """Names that ``make_solver`` knows."""
    return qp_solvers.names()


def make_solver(name: str, tolerance: float | None = None):
    """Returns a new pydrake SolverInterface for quadratic programs.

    Args:
        name: see ``solver_names``.
        tolerance: on the residuals, for controllers that trade accuracy for time; None for each solver's own default.
            Drake's own solvers keep theirs.

    Raises:
        UserInputError: there is no such solver; MissingSolverError: it is not installed.
    """
    with needed_for(name):
        return qp_solvers.get(name).factory(tolerance)


def solve_program(solver, prog, initial_guess=None) -> tuple[np.ndarray, SolveDetails]:
    """Solves ``prog`` with any solver, ours or Drake's. Returns the solution (NaN where there is none) and the details."""
    if isinstance(solver, QpSolver):
        return solver.solve_program(prog, initial_guess)
    start = time.perf_counter()
    result = solver.Solve(prog, initial_guess, _drake_options(solver))
    elapsed = time.perf_counter() - start
    details = result.get_solver_details()
    # OSQP and Clarabel call the same things by different names.
    iterations = int(getattr(details, "iter", getattr(details, "iterations", 0)))
    status = str(getattr(details, "status", getattr(details, "status_val", result.get_solution_result())))
    residuals = (float(getattr(details, "primal_res", np.nan)), float(getattr(details, "dual_res", np.nan)))
    outcome = SolveDetails(
        solver.solver_id().name(), result.get_solution_result(), status, iterations, elapsed, 0.0, *residuals
    )
    return (result.get_x_val() if outcome.success else np.full(prog.num_vars(), np.nan)), outcome


def _drake_options(solver):
    options = SolverOptions()
    if isinstance(solver, OsqpSolver):
        options.SetOption(SolverId("OSQP"), "verbose", 0)
        options.SetOption(SolverId("OSQP"), "max_iter", 20000)
        options.SetOption(SolverId("OSQP"), "eps_abs", 1e-5)
        options.SetOption(SolverId("OSQP"), "eps_rel", 1e-5)
    return options
