"""Ruiz's equilibration of a sparse quadratic program: rows and columns of the KKT matrix are brought to like size."""

import numpy as np
from numba import njit


@njit(cache=True)
def _largest_of_hessian(data, indices, indptr, column_scale, largest):
    """Raises ``largest`` to the largest entry in each row of the scaled symmetric matrix whose upper triangle is given."""
    for j in range(len(column_scale)):
        scale, top = column_scale[j], 0.0
        for k in range(indptr[j], indptr[j + 1]):
            i = indices[k]
            size = abs(data[k]) * (column_scale[i] * scale)
            top = max(top, size)
            if size > largest[i]:
                largest[i] = size
        if top > largest[j]:
            largest[j] = top


@njit(cache=True)
def _largest_of_rows(data, indices, indptr, row_scale, column_scale, by_row, by_column):
    """Raises the largest entries of each scaled row and column of a matrix."""
    for j in range(len(column_scale)):
        scale, top = column_scale[j], 0.0
        for k in range(indptr[j], indptr[j + 1]):
            i = indices[k]
            size = abs(data[k]) * (row_scale[i] * scale)
            top = max(top, size)
            if size > by_row[i]:
                by_row[i] = size
        if top > by_column[j]:
            by_column[j] = top


@njit(cache=True)
def _divide_by_roots(scale, largest):
    for i in range(len(scale)):
        if largest[i] > 1e-12:  # an empty row or column stays as it is
            scale[i] /= np.sqrt(largest[i])


@njit(cache=True)
def _scaled(data, indices, indptr, row_scale, column_scale, out):
    for j in range(len(column_scale)):
        scale = column_scale[j]
        for k in range(indptr[j], indptr[j + 1]):
            out[k] = data[k] * (row_scale[indices[k]] * scale)


@njit(cache=True, nogil=True)
def _equilibrate(rounds, hessian, equalities, inequalities, x_scale, y_scale, z_scale, out):
    x_scale[:], y_scale[:], z_scale[:] = 1.0, 1.0, 1.0
    for _ in range(rounds):
        x_largest, y_largest, z_largest = np.zeros_like(x_scale), np.zeros_like(y_scale), np.zeros_like(z_scale)
        _largest_of_hessian(*hessian, x_scale, x_largest)
        _largest_of_rows(*equalities, y_scale, x_scale, y_largest, x_largest)
        _largest_of_rows(*inequalities, z_scale, x_scale, z_largest, x_largest)
        _divide_by_roots(x_scale, x_largest)
        _divide_by_roots(y_scale, y_largest)
        _divide_by_roots(z_scale, z_largest)
    _scaled(*hessian, x_scale, x_scale, out[0])
    _scaled(*equalities, y_scale, x_scale, out[1])
    _scaled(*inequalities, z_scale, x_scale, out[2])


class EquilibratedProgram:
    """A scaled copy of a quadratic program's matrices (D. Ruiz: "A scaling algorithm to equilibrate both rows and columns
    norms in matrices", 2001), with buffers that are used again as long as the patterns stay.

    With x = diag(x_scale) xs the program reads the same in xs. The scaling follows from the program alone, so equal programs
    give equal answers to the last bit; PIQP's own scaling starts from that of the program before.
    """

    def __init__(self, matrices):
        self.P, self.A, self.G = matrices.P.copy(), matrices.A.copy(), matrices.G.copy()
        self.x_scale = np.ones(matrices.num_vars)
        self._y_scale, self._z_scale = np.ones(self.A.shape[0]), np.ones(self.G.shape[0])
        # Without a sign, so that kernels need not ask whether an index counts from the end: three times as fast.
        self._patterns = [(m.indices.view(np.uint32), m.indptr.view(np.uint32)) for m in (self.P, self.A, self.G)]

    def load(self, matrices, rounds: int) -> None:
        """Scales ``matrices`` (ProgramMatrices of the same pattern) in so many rounds; 0 leaves them as they are."""
        data = matrices.P.data, matrices.A.data, matrices.G.data
        sources = ((values, *pattern) for values, pattern in zip(data, self._patterns, strict=True))
        out = self.P.data, self.A.data, self.G.data
        _equilibrate(rounds, *sources, self.x_scale, self._y_scale, self._z_scale, out)
        self.c, self.b = self.x_scale * matrices.c, self._y_scale * matrices.b
        self.h_l, self.h_u = self._z_scale * matrices.h_l, self._z_scale * matrices.h_u
        self.x_l, self.x_u = matrices.x_l / self.x_scale, matrices.x_u / self.x_scale
