"""What one solve of the optimal control problem is about: reference, contacts, feet, surfaces."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.trajectory.ocp.knot_kernels import TaskArrays
from quadpips_drake.values.legs import NUM_LEGS
from quadpips_drake.values.regions import SignedDistance

_NO_GROUND = SignedDistance.empty()
_NO_HALFSPACES = np.zeros((1, NUM_LEGS, 1, 3)), np.zeros((1, NUM_LEGS, 1))


@dataclass
class TrackingTask:
    """Reference and contacts on a grid of N intervals; all in W. Knot k holds from ``times[k]`` to ``times[k + 1]``."""

    times: np.ndarray
    """Knot times [s], increasing, (N + 1,)."""
    x_ref: np.ndarray
    """(N + 1, 24)"""
    u_ref: np.ndarray
    """(N, 24)"""
    stance: np.ndarray
    """Which feet are down in each interval, bool, (N, 4)."""
    foot_ref_p: np.ndarray
    """Centres of the feet [m], (N + 1, 4, 3): on the spline for a swinging foot, the touch-down point for a stance foot."""
    foot_ref_v: np.ndarray
    """[m/s], (N + 1, 4, 3)"""
    surface_normal: np.ndarray
    """Upward unit normal under each foot: of the friction cone in stance, of the spline's constraint in swing, (N, 4, 3)."""
    halfspace_normals: np.ndarray | None = None
    """Regions of stance feet: normals @ p + offsets >= 0, (N, 4, m, 3); rows of zeros where there are fewer."""
    halfspace_offsets: np.ndarray | None = None
    """(N, 4, m)"""
    friction: float | None = None
    """Friction coefficient; None for the one in the configuration."""
    ground: SignedDistance | None = None
    """What knees and trunk stay clear of; None: nothing is known, or matters."""

    @property
    def num_knots(self) -> int:
        return len(self.times) - 1

    def arrays(self, friction: float) -> TaskArrays:
        """Returns the contiguous arrays for the kernels; ``friction`` holds where the task brings none."""
        n = self.num_knots
        normals, offsets = self.halfspace_normals, self.halfspace_offsets
        if normals is None:
            normals, offsets = (np.broadcast_to(a, (n, *a.shape[1:])) for a in _NO_HALFSPACES)
        ground = self.ground or _NO_GROUND
        return TaskArrays(
            times=np.array(self.times, dtype=float, order="C"),
            x_ref=np.array(self.x_ref, dtype=float, order="C"),
            u_ref=np.array(self.u_ref, dtype=float, order="C"),
            stance=np.array(self.stance, dtype=bool, order="C"),
            foot_ref_p=np.array(self.foot_ref_p, dtype=float, order="C"),
            foot_ref_v=np.array(self.foot_ref_v, dtype=float, order="C"),
            surface_normal=np.array(self.surface_normal, dtype=float, order="C"),
            halfspace_normals=np.array(normals, dtype=float, order="C"),
            halfspace_offsets=np.array(offsets, dtype=float, order="C"),
            friction=float(friction if self.friction is None else self.friction),
            distance=np.array(ground.distance, dtype=np.float32, order="C"),
            distance_origin=np.array(ground.origin, dtype=float),
            distance_step=float(ground.step),
        )


def joined_tasks(tasks) -> TrackingTask:
    """Returns one task over consecutive ones, each of which has its own time from 0; region rows are padded alike."""
    starts = np.concatenate(([0.0], np.cumsum([task.times[-1] for task in tasks])))
    rows = max((task.halfspace_offsets.shape[2] for task in tasks if task.halfspace_offsets is not None), default=0)
    normals = np.concatenate([_padded(task.halfspace_normals, (task.num_knots, NUM_LEGS, rows, 3)) for task in tasks])
    offsets = np.concatenate([_padded(task.halfspace_offsets, (task.num_knots, NUM_LEGS, rows)) for task in tasks])

    def points(name):  # at a seam, the later task's point of view
        return np.concatenate([*(getattr(task, name)[:-1] for task in tasks), getattr(tasks[-1], name)[-1:]])

    return TrackingTask(
        times=np.concatenate([*(start + task.times[:-1] for start, task in zip(starts, tasks, strict=False)), [starts[-1]]]),
        x_ref=points("x_ref"),
        u_ref=np.concatenate([task.u_ref for task in tasks]),
        stance=np.concatenate([task.stance for task in tasks]),
        foot_ref_p=points("foot_ref_p"),
        foot_ref_v=points("foot_ref_v"),
        surface_normal=np.concatenate([task.surface_normal for task in tasks]),
        halfspace_normals=normals if rows else None,
        halfspace_offsets=offsets if rows else None,
        friction=tasks[0].friction,
    )


def _padded(array, shape):
    out = np.zeros(shape)
    if array is not None:
        out[:, :, : array.shape[2]] = array
    return out


@dataclass(frozen=True, eq=False)
class Guess:
    """Where to linearise: states (N + 1, 24) and inputs (N, 24) at ``times``."""

    X: np.ndarray
    U: np.ndarray
    times: np.ndarray


@dataclass(frozen=True, eq=False)
class OcpSolution:
    """Result of the optimal control problem; also good as a guess."""

    success: bool
    """Whether states and inputs can be used (the last quadratic program was solved; ``solve``: and it converged)."""
    status: str
    """What happened, in words: "converged", "iteration", or why not."""
    X: np.ndarray
    """States (N + 1, 24)."""
    U: np.ndarray
    """Inputs (N, 24)."""
    times: np.ndarray
    """(N + 1,) [s]"""
    iterations: int = 0
    """SQP iterations."""
    qp_iterations: int = 0
    """Iterations of all quadratic programs together."""
    cost: float = np.nan
    """At the point of the last linearisation."""
    constraint_violation: float = np.nan
    """Norm of shooting defects and state-input equalities at the point of the last linearisation."""
    linearisation_time: float = 0.0
    """[s], like the following."""
    assembly_time: float = 0.0
    """Updating the MathematicalProgram and turning it into the solver's matrices."""
    qp_time: float = 0.0

    @property
    def solve_time(self) -> float:
        """Total computing time [s]."""
        return self.linearisation_time + self.assembly_time + self.qp_time


def shift_guess(solution, new_times) -> Guess:
    """Returns ``solution`` (an OcpSolution or Guess) on another grid, as a warm start for the next solve.

    States are interpolated, inputs held; beyond the end the last values stay.
    """
    new_times = np.asarray(new_times, dtype=float, order="C")
    old = solution.times
    right = np.clip(np.searchsorted(old, new_times, side="right"), 1, len(old) - 1)
    part = np.clip((new_times - old[right - 1]) / (old[right] - old[right - 1]), 0.0, 1.0)[:, None]
    states = (1.0 - part) * solution.X[right - 1] + part * solution.X[right]
    held = np.clip(np.searchsorted(old, new_times[:-1] + 1e-9, side="right") - 1, 0, len(solution.U) - 1)
    return Guess(states, solution.U[held], new_times)
