"""The dense quadratic program of whole-body control, and three ways to solve it.

``PiqpDirect`` hands matrices straight to PIQP. ``DenseQp`` hands them to ProxQP, warm-started by the caller: about as
quick, but the last bits of its answer depend on where its workspace happens to lie in memory (seen with proxsuite 0.8.0:
two new workspaces, the same problem, answers that differ by 1e-7 N m), so that a run cannot be repeated to the bit.
``ProgramQp`` builds the same problem as a MathematicalProgram once, for any solver that the registry knows: twice the time.
"""

import atexit
import weakref
from dataclasses import dataclass

import numpy as np
import piqp
from pydrake.solvers import MathematicalProgram

from quadpips_drake.solvers.missing_solver import needed_for
from quadpips_drake.solvers.registry import make_solver, solve_program
from quadpips_drake.values.immutable import ImmutableValue


@dataclass(frozen=True, eq=False)
class QpSolution(ImmutableValue):
    """Primal and dual solution, and what the solver said about it."""

    success: bool
    status: str
    iterations: int
    x: np.ndarray
    """Primal, (n,)."""
    y: np.ndarray
    """Multipliers of the equalities; empty from a solver that starts from none."""
    z: np.ndarray
    """Multipliers of the inequalities; likewise."""


_NO_MULTIPLIERS = np.zeros(0)
_NO_MULTIPLIERS.flags.writeable = False


# Drake's Python systems are never garbage collected (their callbacks refer to them), and ProxQP's bindings complain
# at exit about everything that is still alive then: the workspaces are let go of just before.
_alive: weakref.WeakSet = weakref.WeakSet()


@atexit.register
def _release():
    for qp in list(_alive):
        qp.release()


class DenseQp:
    """min 1/2 x^T H x + g^T x  such that  A x = b,  l <= C x <= u, of fixed size.

    The workspace is scratch memory: the problem is set completely on each call and the warm start is an argument, so that
    the answer depends on nothing else.
    """

    def __init__(
        self, variables: int, equalities: int, inequalities: int, *, tolerance: float = 1e-5, max_iterations: int = 100
    ):
        with needed_for("proxqp_dense"):
            from proxsuite import proxqp
        self._proxqp = proxqp
        self._qp = proxqp.dense.QP(variables, equalities, inequalities)
        self._qp.settings.eps_abs = tolerance
        self._qp.settings.eps_rel = 0.0
        self._qp.settings.max_iter = max_iterations
        # Small residuals alone say little: multipliers of constraints that are far from active keep them small, too.
        self._qp.settings.check_duality_gap = True
        self._qp.settings.eps_duality_gap_abs = 10.0 * tolerance
        self._qp.settings.eps_duality_gap_rel = 0.0
        self._initialised = False
        _alive.add(self)

    def release(self):
        """Frees the workspace; nothing can be solved afterwards."""
        self._qp = None

    def solve(self, H, g, A, b, C, lower, upper, warm: QpSolution | None = None) -> QpSolution:
        """Solves the program; a failure is a value with ``success`` False."""
        qp = self._qp
        if self._initialised:
            qp.update(H, g, A, b, C, lower, upper, False)
        else:
            # Without a preconditioner: it takes three times as long as the solution, and the caller scales the problem.
            qp.init(H, g, A, b, C, lower, upper, False)
            self._initialised = True
        guess = self._proxqp.InitialGuess
        if warm is not None:
            qp.settings.initial_guess = guess.WARM_START
            qp.solve(warm.x, warm.y, warm.z)
        else:
            qp.settings.initial_guess = guess.EQUALITY_CONSTRAINED_INITIAL_GUESS
            qp.solve()
        info = qp.results.info
        solved = info.status == self._proxqp.PROXQP_SOLVED
        return QpSolution(
            solved,
            "solved" if solved else str(info.status).split(".")[-1].lower(),
            int(info.iter),
            np.array(qp.results.x),
            np.array(qp.results.y),
            np.array(qp.results.z),
        )


class PiqpDirect:
    """The problem of ``DenseQp``, solved by PIQP's dense interior-point method, always from scratch.

    The answer depends on the problem alone, to the last bit.
    """

    _LEAST_WIDTH = 1e-6
    """An interior point needs room: bounds that coincide (of a foot in the air, say) are moved apart by this."""

    def __init__(
        self, variables: int, equalities: int, inequalities: int, *, tolerance: float = 1e-5, max_iterations: int = 100
    ):
        self._solver = piqp.DenseSolver()
        settings = self._solver.settings
        settings.verbose = False
        settings.eps_abs, settings.eps_rel = tolerance, 0.0
        settings.check_duality_gap = True
        settings.eps_duality_gap_abs, settings.eps_duality_gap_rel = 10.0 * tolerance, 1e-6
        settings.max_iter = max_iterations
        settings.preconditioner_iter = 1  # the caller scales the problem
        settings.preconditioner_reuse_on_update = False
        # Its default test takes programs with little room for infeasible.
        settings.eps_primal_inf = 1e-12
        self._load = self._solver.setup

    def solve(self, H, g, A, b, C, lower, upper, warm: QpSolution | None = None) -> QpSolution:
        """Solves the program; ``warm`` is not used. A failure is a value with ``success`` False."""
        upper = np.maximum(upper, lower + self._LEAST_WIDTH)
        equalities = (np.asfortranarray(A), b) if len(b) else (None, None)
        self._load(np.asfortranarray(H), g, *equalities, np.asfortranarray(C), lower, upper)
        self._load = self._solver.update
        status = self._solver.solve()
        result = self._solver.result
        x, iterations = result.x.copy(), int(result.info.iter)
        if status == piqp.PIQP_SOLVED:
            return QpSolution(True, "solved", iterations, x, _NO_MULTIPLIERS, _NO_MULTIPLIERS)
        return QpSolution(False, status.name.lower(), iterations, x, _NO_MULTIPLIERS, _NO_MULTIPLIERS)


class ProgramQp:
    """The problem of ``DenseQp`` as a MathematicalProgram, built once and updated, solved by a solver of the registry.

    There is no warm start: multipliers do not pass through a MathematicalProgram.
    """

    def __init__(self, variables: int, equalities: int, inequalities: int, *, solver: str):
        self._solver = make_solver(solver)
        self._program = MathematicalProgram()
        x = self._program.NewContinuousVariables(variables, "z")
        eye, zero = np.eye(variables), np.zeros(variables)
        self._cost = self._program.AddQuadraticCost(eye, zero, x, is_convex=True).evaluator()
        A, C = np.ones((equalities, variables)), np.ones((inequalities, variables))
        self._equality = None
        if equalities:
            self._equality = self._program.AddLinearEqualityConstraint(A, np.zeros(equalities), x).evaluator()
        self._inequality = self._program.AddLinearConstraint(C, -np.ones(inequalities), np.ones(inequalities), x).evaluator()

    def solve(self, H, g, A, b, C, lower, upper, warm: QpSolution | None = None) -> QpSolution:
        """Solves the program; ``warm`` is not used."""
        # Bounds that coincide (a foot in the air) would turn rows into equalities and change the structure of the program.
        upper = np.maximum(upper, lower + 1e-6)
        self._cost.UpdateCoefficients(H, g, is_convex=True)
        if self._equality is not None:
            self._equality.UpdateCoefficients(A, b)
        self._inequality.UpdateCoefficients(C, lower, upper)
        x, details = solve_program(self._solver, self._program)
        return QpSolution(details.success, details.status, details.iterations, x, np.zeros(len(b)), np.zeros(len(lower)))


_DIRECT = {"piqp_direct": PiqpDirect, "proxqp_dense": DenseQp}


def make_whole_body_qp(solver: str, variables: int, equalities: int, inequalities: int) -> PiqpDirect | DenseQp | ProgramQp:
    """Returns a solver for programs of that size.

    ``piqp_direct`` is PiqpDirect, ``proxqp_dense`` DenseQp, all else a name of the registry, by ProgramQp.
    """
    if solver in _DIRECT:
        return _DIRECT[solver](variables, equalities, inequalities)
    return ProgramQp(variables, equalities, inequalities, solver=solver)
