"""ProxQP as a Drake solver: a proximal augmented-Lagrangian method, quick on small dense programs."""

import numpy as np
import proxsuite
import scipy.sparse as sp
from pydrake.solvers import SolutionResult, SolverId

from quadpips_drake.solvers.qp_solver import QpSolver

_PROXQP = proxsuite.proxqp
_STATUS = _PROXQP.QPSolverOutput
_RESULTS = {
    _STATUS.PROXQP_SOLVED: SolutionResult.kSolutionFound,
    _STATUS.PROXQP_MAX_ITER_REACHED: SolutionResult.kIterationLimit,
    _STATUS.PROXQP_PRIMAL_INFEASIBLE: SolutionResult.kInfeasibleConstraints,
    _STATUS.PROXQP_DUAL_INFEASIBLE: SolutionResult.kUnbounded,
}


class ProxQpSolver(QpSolver):
    """ProxQP (Bambade, El-Kazdadi, Taylor, Carpentier: "ProxQP: Yet another Quadratic Programming Solver", RSS 2022).

    Programs of up to ``dense_limit`` variables go to the dense back-end, larger ones to the sparse one. With ``warm_start``
    each solve of a program starts from its last solution; without it (the default) the answer depends on the program alone.
    An initial guess given to ``Solve`` is used either way. Further keyword arguments are ProxQP's settings.
    """

    ID = SolverId("ProxQP")

    def __init__(self, *, dense_limit: int = 150, warm_start: bool = False, **settings):
        QpSolver.__init__(self, {"eps_abs": 1e-6, "eps_rel": 0.0, **settings})
        self._dense_limit = dense_limit
        self._warm_start = warm_start

    def _solve_matrices(self, entry, changed, settings, initial_guess):
        qp = entry.matrices
        data = self._problem_data(qp)
        fresh = entry.backend is None or changed or not self._warm_start
        if fresh:
            entry.backend = self._new_backend(qp)
        solver = entry.backend
        guess = _PROXQP.InitialGuess
        solver.settings.initial_guess = guess.NO_INITIAL_GUESS if fresh else guess.WARM_START_WITH_PREVIOUS_RESULT
        for name, value in settings.items():
            setattr(solver.settings, name, value)
        if fresh:
            solver.init(*data)
        else:
            solver.update(*data)
        if initial_guess is not None and np.all(np.isfinite(initial_guess)):
            solver.settings.initial_guess = guess.WARM_START
            solver.solve(initial_guess, None, None)
        else:
            solver.solve()
        info = solver.results.info
        result = _RESULTS.get(info.status, SolutionResult.kSolverSpecificError)
        residuals = (float(info.pri_res), float(info.dua_res))
        return np.array(solver.results.x), result, info.status.name, int(info.iter), residuals

    def _is_dense(self, qp):
        return qp.num_vars <= self._dense_limit

    def _has_box(self, qp):
        return bool(np.isfinite(qp.x_l).any() or np.isfinite(qp.x_u).any())

    def _new_backend(self, qp):
        num_equalities, num_inequalities = qp.A.shape[0], qp.G.shape[0]
        if self._is_dense(qp):
            return _PROXQP.dense.QP(qp.num_vars, num_equalities, num_inequalities, self._has_box(qp))
        if self._has_box(qp):
            num_inequalities += qp.num_vars
        return _PROXQP.sparse.QP(qp.num_vars, num_equalities, num_inequalities)

    def _problem_data(self, qp):
        """Arguments of ProxQP's init and update: the dense back-end takes box constraints, the sparse one only rows."""
        large = 1e20
        h_l, h_u = np.clip(qp.h_l, -large, large), np.clip(qp.h_u, -large, large)
        x_l, x_u = np.clip(qp.x_l, -large, large), np.clip(qp.x_u, -large, large)
        if self._is_dense(qp):
            upper = qp.P.toarray()
            hessian = upper + np.triu(upper, 1).T
            data = (hessian, qp.c, qp.A.toarray(), qp.b, qp.G.toarray(), h_l, h_u)
            return (*data, x_l, x_u) if self._has_box(qp) else data
        hessian = (qp.P + sp.triu(qp.P, 1).T).tocsc()
        if not self._has_box(qp):
            return hessian, qp.c, qp.A, qp.b, qp.G, h_l, h_u
        rows = sp.vstack((qp.G, sp.identity(qp.num_vars)), format="csc")
        return hessian, qp.c, qp.A, qp.b, rows, np.concatenate((h_l, x_l)), np.concatenate((h_u, x_u))
