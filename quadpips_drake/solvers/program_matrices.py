"""From a MathematicalProgram to the matrices of a quadratic program, with the structure worked out once.

    min 1/2 x'Px + c'x   subject to   A x = b,  h_l <= G x <= h_u,  x_l <= x <= x_u

Looking up variables is what makes such a conversion slow in Python. ``ProgramMatrices`` does it once for a program; after
that ``refill`` only copies coefficients into the sparse matrices, whose patterns stay as they are.
"""

import numpy as np
import scipy.sparse as sp
from pydrake.solvers import GetProgramType, MathematicalProgram, ProgramType


def is_quadratic_program(prog: MathematicalProgram) -> bool:
    """Whether ``prog`` is a linear or a convex quadratic program."""
    return GetProgramType(prog) in (ProgramType.kQP, ProgramType.kLP)


def _linear_constraints(prog):
    return prog.linear_equality_constraints() + prog.linear_constraints()


class _ScatteredMatrix:
    """A CSC matrix that is the sum of scattered entries: rows and columns are fixed, only the values change."""

    def __init__(self, rows, columns, shape):
        order = np.lexsort((rows, columns))
        keys = columns[order].astype(np.int64) * max(shape[0], 1) + rows[order]
        first = np.ones(len(keys), dtype=bool)
        first[1:] = keys[1:] != keys[:-1]
        self._slots = np.empty(len(keys), dtype=np.int64)
        self._slots[order] = np.cumsum(first) - 1
        indices = rows[order][first].astype(np.int32)
        indptr = np.searchsorted(columns[order][first], np.arange(shape[1] + 1)).astype(np.int32)
        self.matrix = sp.csc_matrix((np.zeros(len(indices)), indices, indptr), shape=shape)
        self._unique = len(indices) == len(keys)
        self._in_order = self._unique and np.array_equal(self._slots, np.arange(len(keys)))

    def fill(self, values):
        data = self.matrix.data
        if self._in_order:
            data[:] = values
        elif self._unique:
            data[self._slots] = values
        elif len(values):
            data[:] = np.bincount(self._slots, weights=values, minlength=len(data))


class QuadraticMatrices:
    """A quadratic program as the solvers see it; sparse matrices are ``scipy.sparse.csc_matrix``."""

    num_vars: int
    P: sp.csc_matrix
    """Upper triangle."""
    c: np.ndarray
    A: sp.csc_matrix
    b: np.ndarray
    G: sp.csc_matrix
    h_l: np.ndarray
    h_u: np.ndarray
    x_l: np.ndarray
    x_u: np.ndarray

    def cost(self, x) -> float:
        """Value of the cost at ``x``, constants left out."""
        upper = self.P @ x
        return float(x @ upper - 0.5 * (x * self.P.diagonal()) @ x + self.c @ x)


class ProgramMatrices(QuadraticMatrices):
    """The quadratic program in ``prog`` as matrices, and the bookkeeping to refill them when coefficients change.

    Rows of a constraint and variables whose bounds coincide appear in A, as an interior-point method needs.
    """

    def __init__(self, prog: MathematicalProgram):
        self.num_vars = prog.num_vars()
        self._quadratics = [b.evaluator() for b in prog.quadratic_costs()]
        self._linears = [b.evaluator() for b in prog.linear_costs()]
        self._constraints = [b.evaluator() for b in _linear_constraints(prog)]
        self._boxes = [b.evaluator() for b in prog.bounding_box_constraints()]
        self._quadratic_vars = [prog.FindDecisionVariableIndices(b.variables()) for b in prog.quadratic_costs()]
        self._linear_vars = [prog.FindDecisionVariableIndices(b.variables()) for b in prog.linear_costs()]
        self._constraint_vars = [prog.FindDecisionVariableIndices(b.variables()) for b in _linear_constraints(prog)]
        self._box_vars = [prog.FindDecisionVariableIndices(b.variables()) for b in prog.bounding_box_constraints()]
        # Ids are compared to recognise the program; holding the evaluators keeps these ids from being given to others.
        self._signature = self.signature_of(prog)
        self._build_hessian_pattern()
        self._linear_slots = _joined([np.asarray(v) for v in self._quadratic_vars + self._linear_vars], int)
        self._patterns = None
        self._equality_rows = None
        self.refill()

    @staticmethod
    def signature_of(prog: MathematicalProgram) -> tuple:
        """What a program is recognised by: its size and the identity of its costs and constraints."""
        bindings = prog.quadratic_costs() + prog.linear_costs() + _linear_constraints(prog) + prog.bounding_box_constraints()
        return (prog.num_vars(), *(id(binding.evaluator()) for binding in bindings))

    @property
    def signature(self) -> tuple:
        return self._signature

    def _build_hessian_pattern(self):
        rows, columns, self._upper, self._factors = [], [], [], []
        for indices in self._quadratic_vars:
            j, i = np.tril_indices(len(indices))  # the upper triangle column by column, as the sparse matrix wants it
            row, column = np.asarray(indices)[i], np.asarray(indices)[j]
            # A variable that is listed twice brings both off-diagonal entries to one place on the diagonal.
            self._factors.append(np.where((row == column) & (i != j), 2.0, 1.0))
            rows.append(np.minimum(row, column))
            columns.append(np.maximum(row, column))
            self._upper.append(i * len(indices) + j)
        shape = (self.num_vars, self.num_vars)
        self._hessian = _ScatteredMatrix(_joined(rows, int), _joined(columns, int), shape)
        self._repeated = any((f != 1.0).any() for f in self._factors)
        self._all_factors = _joined(self._factors, float)
        self.P = self._hessian.matrix

    def refill(self) -> bool:
        """Copies all coefficients again. Returns True when a pattern had to change, so that a solver must be set up anew."""
        self._fill_cost()
        matrices = [evaluator.get_sparse_A() for evaluator in self._constraints]
        lower = _joined([evaluator.lower_bound() for evaluator in self._constraints], float)
        upper = _joined([evaluator.upper_bound() for evaluator in self._constraints], float)
        self.x_l, self.x_u = self._box_bounds()
        equality_rows, fixed = lower == upper, self.x_l == self.x_u
        changed = not self._same_patterns(matrices, equality_rows, fixed)
        if changed:
            self._build_constraint_patterns(matrices, equality_rows, fixed)
        values = _joined([matrix.data for matrix in matrices], float)
        ones = np.ones(self._num_fixed)
        self._equalities.fill(np.concatenate((values[self._equality_entries], ones)))
        self._inequalities.fill(values[self._inequality_entries])
        self.b = np.concatenate((lower[equality_rows], self.x_l[fixed]))
        self.h_l, self.h_u = lower[~equality_rows], upper[~equality_rows]
        self.x_l[fixed], self.x_u[fixed] = -np.inf, np.inf
        return changed

    def _fill_cost(self):
        values = _joined([e.Q().ravel()[upper] for e, upper in zip(self._quadratics, self._upper, strict=True)], float)
        self._hessian.fill(values * self._all_factors if self._repeated else values)
        linear = [evaluator.b() for evaluator in self._quadratics] + [evaluator.a() for evaluator in self._linears]
        if linear:
            self.c = np.bincount(self._linear_slots, weights=np.concatenate(linear), minlength=self.num_vars)
        else:
            self.c = np.zeros(self.num_vars)

    def _box_bounds(self):
        lower, upper = np.full(self.num_vars, -np.inf), np.full(self.num_vars, np.inf)
        for evaluator, indices in zip(self._boxes, self._box_vars, strict=True):
            np.maximum.at(lower, indices, evaluator.lower_bound())
            np.minimum.at(upper, indices, evaluator.upper_bound())
        return lower, upper

    def _same_patterns(self, matrices, equality_rows, fixed):
        if self._patterns is None:
            return False
        return (
            np.array_equal(equality_rows, self._equality_rows)
            and np.array_equal(fixed, self._fixed)
            and all(
                len(matrix.indices) == len(indices)
                and np.array_equal(matrix.indices, indices)
                and np.array_equal(matrix.indptr, indptr)
                for matrix, (indices, indptr) in zip(matrices, self._patterns, strict=True)
            )
        )

    def _build_constraint_patterns(self, matrices, equality_rows, fixed):
        self._patterns = [(matrix.indices.copy(), matrix.indptr.copy()) for matrix in matrices]
        self._equality_rows, self._fixed = equality_rows, fixed
        rows, columns, offset = [], [], 0
        for matrix, indices in zip(matrices, self._constraint_vars, strict=True):
            rows.append(matrix.indices + offset)
            columns.append(np.repeat(np.asarray(indices), np.diff(matrix.indptr)))
            offset += matrix.shape[0]
        rows, columns = _joined(rows, int), _joined(columns, int)
        to_equalities = equality_rows[rows]
        self._equality_entries, self._inequality_entries = _selection(to_equalities), _selection(~to_equalities)
        new_row = np.where(equality_rows, np.cumsum(equality_rows), np.cumsum(~equality_rows)) - 1
        num_equalities, num_fixed = int(equality_rows.sum()), int(fixed.sum())
        self._num_fixed = num_fixed
        self._equalities = _ScatteredMatrix(
            np.concatenate((new_row[rows[to_equalities]], num_equalities + np.arange(num_fixed))),
            np.concatenate((columns[to_equalities], np.flatnonzero(fixed))),
            (num_equalities + num_fixed, self.num_vars),
        )
        self._inequalities = _ScatteredMatrix(
            new_row[rows[~to_equalities]],
            columns[~to_equalities],
            (int((~equality_rows).sum()), self.num_vars),
        )
        self.A, self.G = self._equalities.matrix, self._inequalities.matrix


def _selection(flags):
    """What picks the flagged entries: a slice where they are neighbours (much the quickest), else their indices."""
    indices = np.flatnonzero(flags)
    if len(indices) == 0:
        return slice(0, 0)
    if indices[-1] - indices[0] + 1 == len(indices):
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return indices


def _joined(arrays, dtype):
    return np.concatenate(arrays).astype(dtype, copy=False) if arrays else np.zeros(0, dtype=dtype)
