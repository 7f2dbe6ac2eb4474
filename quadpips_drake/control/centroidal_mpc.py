"""Centroidal model predictive control: one real-time iteration of the optimal control problem per call."""

import time as clock
from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.control import mpc_horizon as horizon
from quadpips_drake.control.mpc_policy import MpcPolicy
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.legs import NUM_LEGS, Leg
from quadpips_drake.robots.robot_state import RobotState
from quadpips_drake.trajectory.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.optimal_control_problem import OcpConfig, OptimalControlProblem, TrackingTask
from quadpips_drake.trajectory.reference import ContactSchedule, WholeBodyReference
from quadpips_drake.trajectory.swing_trajectory import SwingConfig, SwingSpline
from quadpips_drake.values import ImmutableValue

_KEEP_SWING = 0.5
"""How long a finished swing stays in the policy [s]: a foot that has not found the ground yet needs it."""


@dataclass
class MpcConfig:
    """Horizon of the MPC and what it does when it fails."""

    horizon: float = 1.0
    """Length [s] (QuadPiPS: 1.0)."""
    intervals: int = 22
    """Number of intervals; they grow towards the end of the horizon [1] (QuadPiPS: 67 equal ones of 15 ms)."""
    first_interval: float = 0.02
    """Length of the first interval [s]."""
    max_consecutive_failures: int = 5
    """After so many failed solves in a row the reference is dropped for standing."""
    ocp: OcpConfig = field(default_factory=OcpConfig)
    """Weights and limits of the optimal control problem."""
    swing: SwingConfig = field(default_factory=SwingConfig)
    """Shape of the swings."""

    def __post_init__(self):
        if self.horizon <= 0.0 or self.first_interval <= 0.0 or self.intervals < 2:
            raise UserInputError("mpc needs a positive horizon and first_interval, and at least 2 intervals")


@dataclass(frozen=True, eq=False)
class MpcMemory(ImmutableValue):
    """What the MPC remembers from one solve to the next."""

    policy: MpcPolicy
    """Result, which also starts the next solve."""
    feet: np.ndarray = None
    """Where each foot stands, or stood at its last lift-off, in W [m], (4, 3)."""
    standing: horizon.StandingPose | None = None
    """The pose kept while there is no reference."""
    consecutive_failures: int = 0

    @staticmethod
    def empty() -> "MpcMemory":
        return MpcMemory(MpcPolicy.empty(), np.zeros((NUM_LEGS, 3)))


class CentroidalMpc:
    """Tracks a whole-body reference with the problem that made it (QuadPiPS section VII-B, eq. 19).

    Each call re-plans the swings from where the feet stand (or stood at lift-off) to the reference's footholds, and improves
    the previous solution, shifted in time, by one SQP iteration (a real-time iteration: M. Diehl et al., 2005).
    """

    def __init__(self, robot, config: MpcConfig | None = None):
        self._robot = robot
        self._config = config or MpcConfig()
        self._model = CentroidalModel(robot)
        self._problem = OptimalControlProblem(self._model, self._config.ocp, self._config.intervals)
        self._offsets = horizon.graded_grid(self._config.first_interval, self._config.horizon, self._config.intervals)

    def compute(self, state: RobotState, reference: WholeBodyReference, memory: MpcMemory) -> MpcMemory:
        """One solve from the measured ``state``. A failure carries the last policy on and is counted in it."""
        start = clock.perf_counter()
        last = memory.policy
        now = state.stamp
        gave_up = memory.consecutive_failures > self._config.max_consecutive_failures
        standing = memory.standing
        if len(reference.times) > 1 and not gave_up:
            standing = None
        elif standing is None:
            standing = horizon.standing_pose(state, self._robot)
        schedule = reference.schedule if standing is None else ContactSchedule.standing()
        feet = self._feet(state, schedule, memory)
        times = now + self._offsets
        swings = horizon.plan_swings(schedule, reference.footholds, feet, now, times[-1], self._make_swing)
        stance = horizon.interval_stance(schedule, times)
        stance = horizon.with_early_contacts(stance, times, state.contacts, swings)
        task = self._task(times, state, reference, standing, stance, swings, feet)
        x0 = self._model.state_from_robot_state(state)
        solution = self._problem.iterate(x0, task, self._guess(x0, task, last))
        elapsed = clock.perf_counter() - start
        if not solution.success:
            policy = _carried_on(last, solution.status, elapsed)
            return MpcMemory(policy, feet, standing, memory.consecutive_failures + 1)
        policy = MpcPolicy(
            stamp=now,
            times=times,
            states=solution.X,
            inputs=solution.U,
            base_twists=self._base_twists(solution.X, solution.U),
            schedule=schedule,
            swings=_with_finished(swings, last.swings, now),
            normals=task.surface_normal[0],
            success=True,
            status=solution.status,
            fallbacks=last.fallbacks,
            solve_time=elapsed,
        )
        return MpcMemory(policy, feet, standing, 0)

    def _feet(self, state: RobotState, schedule: ContactSchedule, memory: MpcMemory) -> np.ndarray:
        """Feet on the ground: where they are. Feet in the air: where they left it."""
        measured = state.p_WB + self._robot.foot_positions_B(state.joint_positions) @ state.R_WB.T
        if memory.policy.is_empty:
            return measured
        return np.where(schedule.at(state.stamp)[:, None], measured, memory.feet)

    def _make_swing(self, liftoff, touchdown, start, end, normal) -> SwingSpline:
        return SwingSpline.plan(liftoff, touchdown, start, end, normal, self._config.swing)

    def _task(self, times, state, reference, standing, stance, swings, feet) -> TrackingTask:
        if standing is not None:
            x_ref, u_ref = horizon.standing_samples(standing, self._robot, len(stance))
        else:
            x_ref = horizon.sampled_states(reference, times, float(state.rpy_WB[2]))
            u_ref = horizon.weight_bearing_inputs(stance, self._robot.mass)
        foot_p, foot_v = horizon.foot_references(swings, feet, times)
        normals = horizon.ground_normals(reference.footholds if standing is None else (), times)
        return TrackingTask(
            times=times,
            x_ref=x_ref,
            u_ref=u_ref,
            stance=stance,
            foot_ref_p=foot_p,
            foot_ref_v=foot_v,
            surface_normal=normals,
        )

    def _guess(self, x0: np.ndarray, task: TrackingTask, last: MpcPolicy) -> tuple[np.ndarray, np.ndarray]:
        """The last solution at the new knots; at the very first, standing still."""
        if last.is_empty:
            return np.tile(x0, (len(task.times), 1)), task.u_ref
        X = np.stack([np.interp(task.times, last.times, column) for column in last.states.T], axis=1)
        middle = 0.5 * (task.times[:-1] + task.times[1:])
        k = np.clip(np.searchsorted(last.times, middle, side="right") - 1, 0, len(last.inputs) - 1)
        U = last.inputs[k].copy()
        # Where the contacts differ from those of the last solution, its forces are no guess at all.
        changed = np.any((np.abs(U[:, : 3 * NUM_LEGS]).reshape(-1, NUM_LEGS, 3).sum(axis=2) > 1e-3) != task.stance, axis=1)
        beyond = middle > last.times[-1]
        U[changed | beyond, : 3 * NUM_LEGS] = task.u_ref[changed | beyond, : 3 * NUM_LEGS]
        X[:, 11] += 2.0 * np.pi * np.round((x0[11] - X[0, 11]) / (2.0 * np.pi))
        return X, U

    def _base_twists(self, X: np.ndarray, U: np.ndarray) -> np.ndarray:
        twists = np.empty((len(X), 6))
        for k, x in enumerate(X):
            v_WB, w_WB = self._model.base_velocity(x, U[min(k, len(U) - 1)])
            twists[k] = np.concatenate((w_WB, v_WB))
        return twists


def _with_finished(swings: tuple, before: tuple, now: float) -> tuple:
    """The new swings, led by each leg's last finished one."""
    merged = []
    for leg in Leg:
        finished = [s for s in before[leg] if now - _KEEP_SWING < s.end_time <= now]
        merged.append((*finished[-1:], *swings[leg]))
    return tuple(merged)


def _carried_on(last: MpcPolicy, status: str, elapsed: float) -> MpcPolicy:
    """The last policy, marked as such; whole-body control reads it at later times."""
    return MpcPolicy(
        last.stamp,
        last.times,
        last.states,
        last.inputs,
        last.base_twists,
        last.schedule,
        last.swings,
        last.normals,
        success=False,
        status=status,
        fallbacks=last.fallbacks + 1,
        solve_time=elapsed,
    )
