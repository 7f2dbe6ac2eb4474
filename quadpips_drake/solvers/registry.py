"""Solvers by name, so that one configuration key chooses the back-end of any problem."""

import time

import numpy as np
from pydrake.solvers import ClarabelSolver, OsqpSolver, SolverId, SolverOptions

from quadpips_drake.errors import unknown_name
from quadpips_drake.solvers.failing_solver import FailingSolver
from quadpips_drake.solvers.piqp_solver import PiqpSolver
from quadpips_drake.solvers.proxqp_solver import ProxQpSolver
from quadpips_drake.solvers.qp_solver import QpSolver, SolveDetails

_FACTORIES = {
    "piqp": lambda tolerance: PiqpSolver("sparse_multistage", **_piqp_settings(tolerance)),
    "piqp_ldlt": lambda tolerance: PiqpSolver("sparse_ldlt", **_piqp_settings(tolerance)),
    "piqp_dense": lambda tolerance: PiqpSolver("dense_cholesky", **_piqp_settings(tolerance)),
    "proxqp": lambda tolerance: ProxQpSolver(**({} if tolerance is None else {"eps_abs": tolerance})),
    "osqp": lambda tolerance: OsqpSolver(),
    "clarabel": lambda tolerance: ClarabelSolver(),
    "failing": lambda tolerance: FailingSolver(),
}


def _piqp_settings(tolerance):
    if tolerance is None:
        return {}
    # Two rounds of equilibration do as well as ten on our problems, and a smaller proximal term and a longer step to the
    # boundary save one or two of seven iterations.
    settings = {"equilibration_rounds": 2, "delta_init": 1e-6, "tau": 0.995, "check_duality_gap": False}
    return {"eps_abs": tolerance, "eps_rel": tolerance, **settings}


def solver_names() -> list[str]:
    """Names that ``make_solver`` knows."""
    return sorted(_FACTORIES)


def make_solver(name: str, tolerance: float | None = None):
    """Returns a new pydrake SolverInterface for quadratic programs.

    Args:
        name: see ``solver_names``.
        tolerance: on the residuals, for controllers that trade accuracy for time; None for each solver's own default.
            Drake's own solvers keep theirs.
    """
    if name not in _FACTORIES:
        raise unknown_name("solver", name, _FACTORIES)
    return _FACTORIES[name](tolerance)


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
