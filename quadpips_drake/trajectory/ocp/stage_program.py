"""The quadratic subproblem of an SQP iteration: matrices that are filled in place, and the same as a MathematicalProgram."""

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numba import njit
from pydrake.solvers import MathematicalProgram

from quadpips_drake.solvers.program_matrices import QuadraticMatrices
from quadpips_drake.solvers.qp_solver import QpSolver, SolveDetails
from quadpips_drake.solvers.registry import solve_program
from quadpips_drake.trajectory.ocp.knot_kernels import KnotBlocks, make_blocks
from quadpips_drake.trajectory.ocp.projection import NUM_FREE
from quadpips_drake.trajectory.ocp.reduction import PACKED, STAGE, unpacked
from quadpips_drake.trajectory.ocp.terms.friction_cone import ROWS
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE

STATES, FREE = STATE_SIZE, NUM_FREE
_FRICTION_ROWS = 4 * ROWS
_LOWER_TRIANGLE = np.tril_indices(STATES)


class StageProgram:
    """Quadratic program over [dx_0, w_0, dx_1, ..., w_{N-1}, dx_N]:

        min  sum_k 1/2 z_k' H_k z_k + g_k' z_k  +  1/2 dx_N' H_N dx_N + g_N' dx_N,     z_k = [dx_k; w_k]
        s.t. dx_0 = given,   dx_{k+1} = D_k z_k + d_k,   friction rows on w_k >= bounds

    Variables go stage by stage, as multistage solvers want them. ``matrices`` are its data for our own back-ends; Hessians,
    gradients and bounds are written into them where they are computed: ``blocks`` holds views. For all other solvers the
    same is a MathematicalProgram, ``prog``, which is built at the first need and then only updated.
    """

    def __init__(self, num_knots: int):
        self.num_knots = n = num_knots
        self.matrices = m = QuadraticMatrices()
        m.num_vars = n * STAGE + STATES
        m.P, m.A, m.G = _hessian_pattern(n), _equality_pattern(n), _friction_pattern(n)
        m.c, m.b, m.h_l = np.zeros(m.num_vars), np.zeros(m.A.shape[0]), np.zeros(m.G.shape[0])
        m.h_u = np.full(m.G.shape[0], np.inf)
        m.x_l, m.x_u = np.full(m.num_vars, -np.inf), np.full(m.num_vars, np.inf)
        # The upper triangle column by column is the lower one row by row.
        self.blocks: KnotBlocks = make_blocks(n)._replace(
            hessian=m.P.data[: n * PACKED].reshape(n, PACKED),
            gradient=m.c[: n * STAGE].reshape(n, STAGE),
            friction_bounds=m.h_l.reshape(n, 4, ROWS),
        )

    def update(self, initial_step, terminal_hessian, terminal_gradient) -> None:
        """Loads what is in ``blocks``, and the ends; ``initial_step`` is dx_0 (24,)."""
        n, m, blocks = self.num_knots, self.matrices, self.blocks
        m.P.data[n * PACKED :] = terminal_hessian[_LOWER_TRIANGLE]
        m.c[n * STAGE :] = terminal_gradient
        m.b[:STATES] = -initial_step
        _fill_constraints(blocks.dynamics, blocks.defect, blocks.friction_rows, m.A.data, m.b, m.G.data)

    def solve(self, solver) -> tuple[np.ndarray, SolveDetails]:
        """Solves the program with a pydrake SolverInterface; returns the solution (NaN where there is none) and details."""
        if isinstance(solver, QpSolver):
            return solver.solve_matrices(self.matrices)
        self._update_program()
        return solve_program(solver, self.prog)

    @cached_property
    def prog(self) -> MathematicalProgram:
        """The program for Drake's solvers; ``solve`` brings it up to date."""
        n, m, prog = self.num_knots, self.matrices, MathematicalProgram()
        z = prog.NewContinuousVariables(m.num_vars)
        stages = [z[k * STAGE : (k + 1) * STAGE] for k in range(n + 1)]
        self._costs = [
            prog.AddQuadraticCost(np.eye(len(stage)), np.zeros(len(stage)), stage, is_convex=True).evaluator()
            for stage in stages
        ]
        self._equalities = prog.AddLinearEqualityConstraint(m.A, m.b, z).evaluator()
        self._inequalities = prog.AddLinearConstraint(m.G, m.h_l, m.h_u, z).evaluator()
        return prog

    def _update_program(self):
        n, m = self.num_knots, self.matrices
        assert self.prog is not None  # builds it
        for k, hessian in enumerate(unpacked(m.P.data[: n * PACKED].reshape(n, PACKED))):
            self._costs[k].UpdateCoefficients(hessian, m.c[k * STAGE : (k + 1) * STAGE], 0.0, True)
        terminal = unpacked(m.P.data[n * PACKED :])
        self._costs[n].UpdateCoefficients(terminal, m.c[n * STAGE :], 0.0, True)
        self._equalities.UpdateCoefficients(m.A, m.b)
        self._inequalities.UpdateCoefficients(m.G, m.h_l, m.h_u)

    def steps(self, solution) -> tuple[np.ndarray, np.ndarray]:
        """Returns dX (N + 1, 24) and dU (N, 24) of the program's solution vector."""
        n, blocks = self.num_knots, self.blocks
        state_steps, input_steps = np.empty((n + 1, STATES)), np.empty((n, INPUT_SIZE))
        _unfold(solution, blocks.input_change, blocks.force_scale, blocks.rate_map, state_steps, input_steps)
        return state_steps, input_steps


def _hessian_pattern(n: int) -> sp.csc_matrix:
    """Upper triangles of the stages' blocks along the diagonal."""
    within, offsets = np.tril_indices(STAGE)[1], STAGE * np.arange(n)[:, None]
    indices = np.concatenate([(within + offsets).ravel(), _LOWER_TRIANGLE[1] + STAGE * n])
    counts = 1 + np.concatenate([np.tile(np.arange(STAGE), n), np.arange(STATES)])
    return _csc(indices, counts, (len(counts), len(counts)))


def _equality_pattern(n: int) -> sp.csc_matrix:
    """dx_0 in the first 24 rows, then 24 for each interval: a column of dx_k has its own row and the column of D_k."""
    columns_of_state = [np.append(i, STATES + np.arange(STATES)) for i in range(STATES)]
    stage_rows = np.concatenate(columns_of_state + [STATES + np.arange(STATES)] * FREE)
    counts = np.concatenate([np.tile([STATES + 1] * STATES + [STATES] * FREE, n), np.ones(STATES, int)])
    inner = (stage_rows + STATES * np.arange(n)[:, None]).ravel()
    indices = np.concatenate([inner, STATES * n + np.arange(STATES)])
    matrix = _csc(indices, counts, (STATES * (n + 1), len(counts)))
    matrix.data[:] = -1.0
    return matrix


def _friction_pattern(n: int) -> sp.csc_matrix:
    """ROWS rows on each leg's three entries of w."""
    leg_rows = np.repeat(np.arange(4)[:, None], 3, axis=1)[:, :, None] * ROWS + np.arange(ROWS)
    indices = (leg_rows.ravel() + _FRICTION_ROWS * np.arange(n)[:, None]).ravel()
    counts = np.append(np.tile([0] * STATES + [ROWS] * FREE, n), np.zeros(STATES, int))
    return _csc(indices, counts, (_FRICTION_ROWS * n, len(counts)))


def _csc(indices, counts, shape) -> sp.csc_matrix:
    indptr = np.concatenate(([0], np.cumsum(counts)))
    data = np.ones(len(indices))
    return sp.csc_matrix((data, indices.astype(np.int32), indptr.astype(np.int32)), shape=shape)


@njit(cache=True, nogil=True)
def _fill_constraints(dynamics, defect, friction_rows, equalities, vector, inequalities):
    """Writes D_k, d_k and the friction rows into the data of A, b and G, column by column."""
    entry, friction = 0, 0
    for k in range(len(dynamics)):
        for column in range(STAGE):
            if column < STATES:
                entry += 1  # -1 for dx_k itself
            for row in range(STATES):
                equalities[entry] = dynamics[k, row, column]
                entry += 1
        for row in range(STATES):
            vector[(k + 1) * STATES + row] = -defect[k, row]
        for leg in range(4):
            for i in range(3):
                for row in range(ROWS):
                    inequalities[friction] = friction_rows[k, leg, row, i]
                    friction += 1


@njit(cache=True, nogil=True)
def _unfold(solution, input_change, force_scale, rate_map, state_steps, input_steps):
    """From [dx_0, w_0, dx_1, ...] to the steps of states and inputs."""
    n = len(input_change)
    for k in range(n + 1):
        for i in range(STATES):
            state_steps[k, i] = solution[k * STAGE + i]
    for k in range(n):
        for i in range(FREE):
            input_steps[k, i] = input_change[k, i] + force_scale[k, i] * solution[k * STAGE + STATES + i]
            rate = input_change[k, FREE + i]
            for j in range(STAGE):
                rate += rate_map[k, i, j] * solution[k * STAGE + j]
            input_steps[k, FREE + i] = rate
