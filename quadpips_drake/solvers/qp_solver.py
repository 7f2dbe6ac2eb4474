"""What the quadratic-programming back-ends share: Drake's solver interface, the cache of program structures, the details."""

import time
from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
from pydrake.solvers import (
    ClpSolver,
    MathematicalProgram,
    MathematicalProgramResult,
    SolutionResult,
    SolverInterface,
)

from quadpips_drake.solvers.program_matrices import ProgramMatrices, QuadraticMatrices, is_quadratic_program


@dataclass(frozen=True)
class SolveDetails:
    """How one solve went."""

    solver: str
    """Name of the solver."""
    result: SolutionResult
    status: str
    """The solver's own word for it."""
    iterations: int = 0
    solve_time: float = 0.0
    """Time in the solver itself, setup included [s]."""
    conversion_time: float = 0.0
    """Time to get matrices out of the MathematicalProgram [s]; 0 where Drake does not tell."""
    primal_residual: float = np.nan
    dual_residual: float = np.nan

    @property
    def success(self) -> bool:
        return self.result == SolutionResult.kSolutionFound


@dataclass
class _CacheEntry:
    matrices: QuadraticMatrices
    """Kept alive by the entry, so no other object gets its identity."""
    bare_program: MathematicalProgram | None = None
    """The same decision variables and nothing else, see ``QpSolver.Solve``."""
    backend: object = None


class QpSolver(SolverInterface):
    """Base of the solvers for linear and convex quadratic programs that Drake does not bring along.

    Structures of the most recent programs are cached: a program that is solved again with other coefficients costs only the
    copying of those coefficients. A program is recognised by the identity of its costs and constraints, so do not bind the
    same evaluator object to other variables.

    Three ways to use it: ``Solve(prog, x0, options, result)`` is Drake's interface; ``solve_program(prog)`` returns the
    solution and a ``SolveDetails``, which a MathematicalProgramResult cannot carry from Python; ``solve_matrices(matrices)``
    does the same for a program whose owner fills the matrices himself.
    """

    _CACHE_SIZE = 8
    ID = None

    def __init__(self, settings: dict):
        SolverInterface.__init__(self)
        self._settings = settings
        self._cache: OrderedDict[tuple | int, _CacheEntry] = OrderedDict()

    # Drake's virtual methods.
    def available(self):
        return True

    def enabled(self):
        return True

    def solver_id(self):
        return self.ID

    def AreProgramAttributesSatisfied(self, prog):
        return is_quadratic_program(prog)

    def ExplainUnsatisfiedProgramAttributes(self, prog):
        return "" if is_quadratic_program(prog) else f"{self.ID.name()} solves only linear and convex quadratic programs"

    def Solve(self, prog, initial_guess=None, solver_options=None, result=None):
        """Solves ``prog`` as Drake's solvers do: into ``result`` (a MathematicalProgramResult), or returns a new one.

        Its cost is not set (Drake has no way to do so from Python): ``prog.EvalBindings(prog.GetAllCosts(), x)`` gives it.
        """
        wanted = result is None
        result = MathematicalProgramResult() if wanted else result
        if not self.AreProgramAttributesSatisfied(prog):
            raise ValueError(self.ExplainUnsatisfiedProgramAttributes(prog))
        options = dict(prog.solver_options().options.get(self.ID.name(), {}))
        if solver_options is not None:
            options.update(solver_options.options.get(self.ID.name(), {}))
        x, details = self.solve_program(prog, initial_guess, options)
        # Python cannot tell a result which variables it holds, only Drake's compiled solvers can: Clp "solves" a program
        # that has these variables and nothing else (some 0.05 ms), then our values replace its own.
        ClpSolver().Solve(self._cache[ProgramMatrices.signature_of(prog)].bare_program, None, None, result)
        result.set_x_val(x)
        result.set_solution_result(details.result)
        return result if wanted else None

    def solve_program(self, prog, initial_guess=None, options: dict | None = None) -> tuple[np.ndarray, SolveDetails]:
        """Returns the solution (NaN when there is none) and the ``SolveDetails``."""
        start = time.perf_counter()
        entry, changed = self._structure(prog)
        return self._solve_entry(entry, changed, initial_guess, options, time.perf_counter() - start)

    def solve_matrices(
        self, matrices: QuadraticMatrices, initial_guess=None, options: dict | None = None
    ) -> tuple[np.ndarray, SolveDetails]:
        """As ``solve_program`` for a program that is kept as matrices; they are recognised by the identity of the object,
        and their patterns never change."""
        entry = self._cache.get(id(matrices))
        known = entry is not None
        if known:
            self._cache.move_to_end(id(matrices))
        else:
            entry = self._keep(id(matrices), _CacheEntry(matrices))
        return self._solve_entry(entry, not known, initial_guess, options, 0.0)

    def _solve_entry(self, entry, changed, initial_guess, options, conversion_time):
        settings = {**self._settings, **(options or {})}
        start = time.perf_counter()
        x, result, status, iterations, residuals = self._solve_matrices(entry, changed, settings, initial_guess)
        details = SolveDetails(
            self.ID.name(), result, status, iterations, time.perf_counter() - start, conversion_time, *residuals
        )
        return (x if details.success else np.full(len(x), np.nan)), details

    def _structure(self, prog):
        signature = ProgramMatrices.signature_of(prog)
        entry = self._cache.get(signature)
        if entry is not None:
            self._cache.move_to_end(signature)
            return entry, entry.matrices.refill()
        bare_program = MathematicalProgram()
        bare_program.AddDecisionVariables(prog.decision_variables())
        matrices = ProgramMatrices(prog)
        # The entry's own signature: pydrake's wrappers of the evaluators keep their identity only from now on.
        return self._keep(matrices.signature, _CacheEntry(matrices, bare_program)), True

    def _keep(self, key, entry: _CacheEntry) -> _CacheEntry:
        self._cache[key] = entry
        while len(self._cache) > self._CACHE_SIZE:
            self._cache.popitem(last=False)
        return entry

    def _solve_matrices(self, entry, changed, settings, initial_guess):
        """Returns x, SolutionResult, status word, iterations, (primal residual, dual residual)."""
        raise NotImplementedError
