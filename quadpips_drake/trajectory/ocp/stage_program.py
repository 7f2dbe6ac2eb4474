"""The quadratic subproblem of an SQP iteration as a MathematicalProgram that is built once and then only updated."""

import numpy as np
import scipy.sparse as sp
from pydrake.solvers import MathematicalProgram

from quadpips_drake.trajectory.ocp.knot_kernels import FREE, STAGE, STATES, KnotBlocks
from quadpips_drake.trajectory.ocp.terms.friction_cone import ROWS

_FRICTION_ROWS = 4 * ROWS


class StageProgram:
    """Quadratic program over [dx_0, w_0, dx_1, ..., w_{N-1}, dx_N]:

        min  sum_k 1/2 z_k' H_k z_k + g_k' z_k  +  1/2 dx_N' H_N dx_N + g_N' dx_N,     z_k = [dx_k; w_k]
        s.t. dx_0 = given,   dx_{k+1} = D_k z_k + d_k,   friction rows on w_k >= bounds

    Variables go stage by stage, as multistage solvers want them. There is one binding for all equalities and one for all
    inequalities, with sparsity patterns that never change: few bindings keep the way to the solver short.
    """

    def __init__(self, num_knots: int):
        self.num_knots = n = num_knots
        self.prog = MathematicalProgram()
        self._variables = self.prog.NewContinuousVariables(n * STAGE + STATES)
        self._costs = [
            self.prog.AddQuadraticCost(np.eye(len(z)), np.zeros(len(z)), z, is_convex=True).evaluator()
            for z in (self._variables[k * STAGE : (k + 1) * STAGE] for k in range(n + 1))
        ]
        self._make_equalities()
        self._make_inequalities()

    def _make_equalities(self):
        n = self.num_knots
        rows_of_state = [np.append(i, STATES + np.arange(STATES)) for i in range(STATES)]
        rows_of_free = [STATES + np.arange(STATES)] * FREE
        stage_rows = np.concatenate(rows_of_state + rows_of_free)
        counts = np.array([STATES + 1] * STATES + [STATES] * FREE)
        indices = np.concatenate([stage_rows + STATES * k for k in range(n)] + [STATES * n + np.arange(STATES)])
        indptr = np.concatenate(([0], np.cumsum(np.concatenate((np.tile(counts, n), np.ones(STATES, int))))))
        shape = (STATES * (n + 1), len(self._variables))
        data = np.full(len(indices), -1.0)
        self._equality_matrix = sp.csc_matrix((data, indices.astype(np.int32), indptr.astype(np.int32)), shape=shape)
        size = len(stage_rows)
        by_stage = self._equality_matrix.data[: n * size].reshape(n, size)
        split = STATES * (STATES + 1)
        # Views into the matrix' data, column by column: -1 for dx_k in its own row, then the column of D_k.
        self._by_state = by_stage[:, :split].reshape(n, STATES, STATES + 1)[:, :, 1:]
        self._by_free = by_stage[:, split:].reshape(n, FREE, STATES)
        self._equality_vector = np.zeros(shape[0])
        binding = self.prog.AddLinearEqualityConstraint(self._equality_matrix, self._equality_vector, self._variables)
        self._equalities = binding.evaluator()

    def _make_inequalities(self):
        n = self.num_knots
        leg_rows = np.repeat(np.arange(4)[:, None], 3, axis=1)[:, :, None] * ROWS + np.arange(ROWS)
        stage_rows = leg_rows.ravel()
        indices = np.concatenate([stage_rows + _FRICTION_ROWS * k for k in range(n)])
        counts = np.concatenate(
            (np.tile(np.concatenate((np.zeros(STATES, int), np.full(FREE, ROWS))), n), np.zeros(STATES, int))
        )
        indptr = np.concatenate(([0], np.cumsum(counts)))
        shape = (_FRICTION_ROWS * n, len(self._variables))
        data = np.ones(len(indices))
        self._friction_matrix = sp.csc_matrix((data, indices.astype(np.int32), indptr.astype(np.int32)), shape=shape)
        self._friction_data = self._friction_matrix.data.reshape(n, 4, 3, ROWS)
        self._no_upper_bound = np.full(shape[0], np.inf)
        self._inequalities = self.prog.AddLinearConstraint(
            self._friction_matrix, np.full(shape[0], -1.0), self._no_upper_bound, self._variables
        ).evaluator()

    def update(self, blocks: KnotBlocks, initial_step, terminal_hessian, terminal_gradient) -> None:
        """Loads the quadratic model; ``initial_step`` is dx_0 (24,)."""
        for cost, hessian, gradient in zip(self._costs, blocks.hessian, blocks.gradient, strict=False):
            cost.UpdateCoefficients(hessian, gradient, 0.0, True)
        self._costs[-1].UpdateCoefficients(terminal_hessian, terminal_gradient, 0.0, True)
        self._by_state[:] = blocks.dynamics[:, :, :STATES].transpose(0, 2, 1)
        self._by_free[:] = blocks.dynamics[:, :, STATES:].transpose(0, 2, 1)
        self._equality_vector[:STATES] = -initial_step
        self._equality_vector[STATES:] = -blocks.defect.ravel()
        self._equalities.UpdateCoefficients(self._equality_matrix, self._equality_vector)
        self._friction_data[:] = blocks.friction_rows.transpose(0, 1, 3, 2)
        self._inequalities.UpdateCoefficients(self._friction_matrix, blocks.friction_bounds.ravel(), self._no_upper_bound)

    def steps(self, solution, blocks: KnotBlocks) -> tuple[np.ndarray, np.ndarray]:
        """Returns dX (N + 1, 24) and dU (N, 24) of the program's solution vector."""
        n = self.num_knots
        stages = solution[: n * STAGE].reshape(n, STAGE)
        state_steps = np.vstack((stages[:, :STATES], solution[None, n * STAGE :]))
        input_steps = blocks.input_change + np.einsum("kij,kj->ki", blocks.input_map, stages)
        return state_steps, input_steps
