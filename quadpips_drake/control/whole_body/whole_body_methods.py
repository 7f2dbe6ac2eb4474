"""Two ways to rank the tasks of whole-body control: by weight in one program, or strictly by priority in a cascade."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.control.whole_body.whole_body_qp import QpSolution, make_whole_body_qp
from quadpips_drake.control.whole_body.whole_body_tasks import Level, Limits

_FEASIBLE = 1e-6
"""How far a least-squares solution may exceed a limit before a program is solved."""
_REGULARISATION = 1e-6
"""Weight of the variables themselves in programs of the cascade: they are unique where a task leaves freedom."""


@dataclass(frozen=True, eq=False)
class WholeBodyProgram:
    """Everything that is asked of z, in the order of priority."""

    equality_matrix: np.ndarray
    """The dynamics of the floating base, A z = b: (6, n)."""
    equality_target: np.ndarray
    """(6,)"""
    airborne: np.ndarray
    """Variables that must be zero (forces of feet in the air), bool (n,)."""
    limits: Limits
    """Friction and torques: never exceeded. z with zero forces always meets them."""
    levels: tuple[Level, ...]
    """Tasks, most important first."""
    scale: np.ndarray
    """Typical sizes of the variables, (n,): solvers see y with z = scale * y."""
    stops: Limits | None = None
    """Joint stops: exceeded as little as possible, second only to ``limits``."""
    stop_weight: float = 1.0
    """Cost of exceeding them in the weighted program."""

    def is_finite(self) -> bool:
        """Whether all numbers are numbers."""
        total = self.equality_matrix.sum() + self.equality_target.sum() + self.limits.matrix.sum() + self.limits.lower.sum()
        return bool(np.isfinite(total + sum(level.task.matrix.sum() + level.task.target.sum() for level in self.levels)))


@dataclass(frozen=True, eq=False)
class MethodSolution:
    """What a method found."""

    success: bool
    """Whether ``x`` can be used."""
    complete: bool
    """Whether every program was solved; a cascade may break off and still have found something."""
    status: str
    iterations: int
    x: np.ndarray
    """(n,)"""
    warm: object = None
    """Where the next program starts from."""


def not_a_number(variables: int) -> MethodSolution:
    """The answer to a problem that is none."""
    return MethodSolution(False, False, "not a number in the problem", 0, np.zeros(variables))


class WeightedMethod:
    """min sum_i w_i |A_i z - b_i|^2 in one program.

    With joint stops, each of them has a slack variable of its own in the same program.
    """

    def __init__(self, solver: str, variables: int, equalities: int, limits: int, stops: int = 0):
        self._size, self._stops = variables, stops
        self._qp = make_whole_body_qp(solver, variables + stops, equalities, limits + stops)

    def solve(self, program: WholeBodyProgram, warm: QpSolution | None) -> MethodSolution:
        """Solves the program; ``warm`` is the last solution."""
        if not program.is_finite():
            return not_a_number(self._size)
        return self.solve_matrices(self.matrices(program), program.scale, warm)

    def solve_matrices(self, matrices: tuple, scale: np.ndarray, warm: QpSolution | None) -> MethodSolution:
        """Solves the program that ``matrices`` (see there), all of them finite but for bounds, stand for."""
        solution = self._qp.solve(*matrices, warm)
        x = scale * solution.x[: self._size]
        x.flags.writeable = False
        warm = solution if len(solution.y) else None
        return MethodSolution(solution.success, solution.success, solution.status, solution.iterations, x, warm)

    def matrices(self, program: WholeBodyProgram) -> tuple:
        """H, g, A, b, C, lower, upper of min 1/2 y'Hy + g'y such that A y = b, lower <= C y <= upper."""
        wish = program.levels[0].weight * program.levels[0].task
        for level in program.levels[1:]:
            wish = wish + level.weight * level.task
        matrix = wish.matrix * program.scale
        H, g = matrix.T @ matrix, -matrix.T @ wish.target
        A, limits = program.equality_matrix * program.scale, program.limits
        C, lower, upper = limits.matrix * program.scale, limits.lower, limits.upper
        if program.stops is not None:
            H, g, A, C, lower, upper = self._with_slack(H, g, A, C, program)
        return H, g, A, program.equality_target, C, lower, upper

    def _with_slack(self, H, g, A, C, program: WholeBodyProgram):
        n, s, stops = self._size, self._stops, program.stops
        quadratic = np.zeros((n + s, n + s))
        quadratic[:n, :n] = H
        quadratic[n:, n:] = program.stop_weight * np.eye(s)
        rows = np.block([[C, np.zeros((len(C), s))], [stops.matrix * program.scale, np.eye(s)]])
        lower = np.concatenate((program.limits.lower, stops.lower))
        upper = np.concatenate((program.limits.upper, stops.upper))
        return quadratic, np.pad(g, (0, s)), np.pad(A, ((0, 0), (0, s))), rows, lower, upper


class HierarchicalMethod:
    """Lexicographic least squares by a cascade of null spaces, one small program for each level.

    Level i looks for z = z_(i-1) + Z_(i-1) xi with the least |A_i z - b_i|, where Z_(i-1) spans what leaves the errors of
    all levels above as they are; then Z_i = Z_(i-1) null(A_i Z_(i-1)). Inequalities hold on every level; soft ones (joint
    stops) have slack on the first level and keep what slack they needed there (O. Kanoun, F. Lamiraux, P.-B. Wieber,
    "Kinematic control of redundant manipulators: generalizing the task-priority framework to inequality tasks", 2011;
    D. Bellicoso et al., "Perception-less terrain adaptation through whole body control and hierarchical optimization",
    2016). The dynamics come first and are met exactly: they can be, whatever else is asked for.

    Where the least-squares solution of a level meets all inequalities it is the optimum, and no program is solved. A level
    whose program fails ends the cascade with the solution of the levels above.
    """

    def __init__(self, solver: str, rank_tolerance: float = 1e-3):
        self._solver = solver
        self._rank_tolerance = rank_tolerance
        self._programs: dict = {}

    def solve(self, program: WholeBodyProgram, warm: object = None) -> MethodSolution:
        """Solves the cascade; ``warm`` is not used."""
        n = program.equality_matrix.shape[1]
        if not program.is_finite():
            return not_a_number(n)
        x, Z = _start(program)
        limits, iterations = program.limits, 0
        for number, level in enumerate(program.levels, start=1):
            stops = program.stops if number == 1 else None
            A, error = level.task.matrix @ Z, level.task.target - level.task.matrix @ x
            left, values, right = np.linalg.svd(A)
            rank = int(np.count_nonzero(values > self._rank_tolerance * max(values[0], 1e-9)))
            step = right[:rank].T @ ((left[:, :rank].T @ error) / values[:rank])
            if not _within(x + Z @ step, limits, stops):
                solution = self._constrained(A, error, x, Z, limits, stops)
                iterations += solution.iterations
                if not solution.success:
                    status = f"level {number} ({level.name}): {solution.status}"
                    return MethodSolution(number > 1, False, status, iterations, x)
                step = solution.x[: Z.shape[1]]
            x = x + Z @ step
            if stops is not None:
                needed = stops.matrix @ x
                limits = limits + Limits(stops.matrix, np.minimum(stops.lower, needed), np.maximum(stops.upper, needed))
            Z = Z @ right[rank:].T
            if Z.shape[1] == 0:
                break
        return MethodSolution(True, True, "solved", iterations, x)

    def _constrained(self, A, error, x, Z, limits: Limits, stops: Limits | None) -> QpSolution:
        """min |A xi - error|^2 such that x + Z xi is within the limits, and within the stops but for slack."""
        n = Z.shape[1]
        H, g = A.T @ A + _REGULARISATION * np.eye(n), -A.T @ error
        rows, offset = limits.matrix @ Z, limits.matrix @ x
        lower, upper = limits.lower - offset, limits.upper - offset
        if stops is not None:
            s, offset = len(stops.lower), stops.matrix @ x
            rows = np.block([[rows, np.zeros((len(rows), s))], [stops.matrix @ Z, np.eye(s)]])
            lower = np.concatenate((lower, stops.lower - offset))
            upper = np.concatenate((upper, stops.upper - offset))
            H = np.block([[H, np.zeros((n, s))], [np.zeros((s, n)), np.eye(s)]])
            g = np.pad(g, (0, s))
        size = rows.shape[1], 0, rows.shape[0]
        if size not in self._programs:
            self._programs[size] = make_whole_body_qp(self._solver, *size)
        return self._programs[size].solve(H, g, np.zeros((0, size[0])), np.zeros(0), rows, lower, upper)


def make_method(config, variables: int, equalities: int, limits: int, stops: int) -> WeightedMethod | HierarchicalMethod:
    """Returns the method that ``config`` (WbcConfig) names, for programs of that size."""
    if config.method == "hierarchical":
        return HierarchicalMethod(config.solver)
    return WeightedMethod(config.solver, variables, equalities, limits, stops if config.joint_stops else 0)


def _start(program: WholeBodyProgram) -> tuple[np.ndarray, np.ndarray]:
    """A z that meets the equalities, and a basis (orthonormal in scaled variables) of all changes that keep them met."""
    free = np.flatnonzero(~program.airborne)
    scale = program.scale[free]
    Q, R = np.linalg.qr((program.equality_matrix[:, free] * scale).T, mode="complete")
    m = R.shape[1]
    x, Z = np.zeros(len(program.scale)), np.zeros((len(program.scale), len(free) - m))
    x[free] = scale * (Q[:, :m] @ np.linalg.solve(R[:m].T, program.equality_target))
    Z[free] = scale[:, None] * Q[:, m:]
    return x, Z


def _within(x: np.ndarray, limits: Limits, stops: Limits | None) -> bool:
    for bound in (limits, stops) if stops is not None else (limits,):
        value = bound.matrix @ x
        if (value < bound.lower - _FEASIBLE).any() or (value > bound.upper + _FEASIBLE).any():
            return False
    return True
