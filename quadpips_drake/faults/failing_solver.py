"""A solver that never finds a solution: for studies of what the rest of the system does then."""

import numpy as np
from pydrake.solvers import SolutionResult, SolverId

from quadpips_drake.framework.registry import Entry
from quadpips_drake.solvers.qp_solver import QpSolver


class FailingSolver(QpSolver):
    """Accepts every quadratic program and solves none."""

    ID = SolverId("Failing")

    def __init__(self):
        QpSolver.__init__(self, {})

    def _solve_matrices(self, entry, changed, settings, initial_guess):
        no_solution = np.full(entry.matrices.num_vars, np.nan)
        return no_solution, SolutionResult.kSolverSpecificError, "fails on purpose", 0, (np.nan, np.nan)


ENTRY = Entry(lambda tolerance: FailingSolver(), summary="finds nothing, for studies of faults")
"""For the registry of QP back-ends, by way of the same entry points as those of other packages (see pyproject.toml)."""
