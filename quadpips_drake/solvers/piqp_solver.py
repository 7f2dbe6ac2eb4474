"""PIQP as a Drake solver: a proximal interior-point method for sparse and dense quadratic programs."""

import numpy as np
import piqp
from pydrake.solvers import SolutionResult, SolverId

from quadpips_drake.errors import unknown_name
from quadpips_drake.solvers.equilibration import EquilibratedProgram
from quadpips_drake.solvers.qp_solver import QpSolver

_RESULTS = {
    piqp.PIQP_SOLVED: SolutionResult.kSolutionFound,
    piqp.PIQP_MAX_ITER_REACHED: SolutionResult.kIterationLimit,
    piqp.PIQP_PRIMAL_INFEASIBLE: SolutionResult.kInfeasibleConstraints,
    piqp.PIQP_DUAL_INFEASIBLE: SolutionResult.kUnbounded,
    piqp.PIQP_INVALID_SETTINGS: SolutionResult.kInvalidInput,
}

KKT_SOLVERS = ("sparse_multistage", "sparse_ldlt", "dense_cholesky")


class PiqpSolver(QpSolver):
    """PIQP (Schwan, Jiang, Kuhn, Jones: "PIQP: A Proximal Interior-Point Quadratic Programming Solver", CDC 2023).

    ``sparse_multistage`` factorises block by block and is made for optimal control problems whose variables are ordered
    stage by stage; ``sparse_ldlt`` suits any sparse program, ``dense_cholesky`` small ones. Further keyword arguments (and
    solver options of the same name) are PIQP's settings. The answer depends on the program alone, not on earlier solves, to
    the last bit: the program is scaled here (``equilibration_rounds``) instead of by PIQP, so PIQP's tolerances hold for
    the residuals of the scaled program.
    """

    ID = SolverId("PIQP")

    def __init__(self, kkt_solver: str = "sparse_multistage", *, equilibration_rounds: int = 10, **settings):
        if kkt_solver not in KKT_SOLVERS:
            raise unknown_name("KKT solver of PIQP", kkt_solver, KKT_SOLVERS)
        QpSolver.__init__(self, {"preconditioner_iter": 0, **settings})
        self._kkt_solver = kkt_solver
        self._rounds = equilibration_rounds

    def _solve_matrices(self, entry, changed, settings, initial_guess):
        dense = self._kkt_solver == "dense_cholesky"
        if entry.backend is None or changed:
            entry.backend = self._new_backend(dense), EquilibratedProgram(entry.matrices)
            load = entry.backend[0].setup
        else:
            load = entry.backend[0].update
        solver, qp = entry.backend
        qp.load(entry.matrices, self._rounds)
        for name, value in settings.items():
            setattr(solver.settings, name, value)
        hessian, equalities, inequalities = qp.P, qp.A, qp.G
        if dense:
            upper = hessian.toarray()
            hessian = upper + np.triu(upper, 1).T
            equalities, inequalities = equalities.toarray(), inequalities.toarray()
        load(hessian, qp.c, equalities, qp.b, inequalities, qp.h_l, qp.h_u, qp.x_l, qp.x_u)
        status = solver.solve()
        info = solver.result.info
        x = qp.x_scale * solver.result.x
        result = _RESULTS.get(status, SolutionResult.kSolverSpecificError)
        return x, result, status.name, int(info.iter), (float(info.primal_res), float(info.dual_res))

    def _new_backend(self, dense):
        solver = piqp.DenseSolver() if dense else piqp.SparseSolver()
        if not dense:
            solver.settings.kkt_solver = getattr(piqp.KKTSolver, self._kkt_solver)
        return solver
