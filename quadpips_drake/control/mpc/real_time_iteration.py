"""Centroidal model predictive control: one real-time iteration of the optimal control problem per call."""

import time as clock
from dataclasses import dataclass, replace

import numpy as np
from pydrake.solvers import SolverInterface

from quadpips_drake.control.early_contact import EARLY_CONTACT_PHASE
from quadpips_drake.control.mpc import foothold_shift, mpc_swings
from quadpips_drake.control.mpc import mpc_horizon as horizon
from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.math.angles import whole_turns
from quadpips_drake.math.interpolation import interpolated
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.ocp.optimal_control_problem import OptimalControlProblem, TrackingTask
from quadpips_drake.values.centroidal import INPUT_SIZE, CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.regions import SignedDistance
from quadpips_drake.values.robot_state import RobotState


@dataclass(frozen=True, eq=False)
class MpcMemory(ImmutableValue):
    """What the MPC remembers from one solve to the next."""

    policy: MpcPolicy
    """The newest result, which also starts the next solve."""
    feet: np.ndarray = None
    """Where each foot stands, or stood at its last lift-off, in W [m], (4, 3)."""
    normals: np.ndarray = None
    """Unit normals of the ground there, (4, 3)."""
    standing: horizon.StandingPose | None = None
    """The pose kept while there is no reference."""
    consecutive_failures: int = 0
    shifts: tuple = ()
    """FootholdShifts of the coming touch-downs."""

    @staticmethod
    def empty() -> "MpcMemory":
        return MpcMemory(MpcPolicy.empty(), np.zeros((NUM_LEGS, 3)), np.tile(mpc_swings.UP, (NUM_LEGS, 1)))


class RealTimeIteration:
    """Tracks a whole-body reference with the problem that made it (QuadPiPS section VII-B, eq. 19).

    Each call re-plans the swings from where the feet stand (or stood at lift-off) to the reference's footholds, and improves
    the previous solution, shifted in time, by one SQP iteration (a real-time iteration: M. Diehl et al., 2005).
    """

    def __init__(self, robot, config: MpcConfig | None = None, early_contact_phase: float = EARLY_CONTACT_PHASE):
        self._robot, self._early_contact_phase = robot, early_contact_phase
        self._config = config or MpcConfig()
        self._offsets = self._config.knots()
        self._model = CentroidalModel(robot, self._config.ocp.model)
        self._problem = OptimalControlProblem(self._model, self._config.ocp, len(self._offsets) - 1)
        self._swings = mpc_swings.SwingPlanner(self._config.swing, robot.foot_radius)
        self._warm_up()

    def _warm_up(self):
        """Loads the compiled code and sets up the solver, so that the first solve takes no longer than any other."""
        state, standing = standing_state(self._robot), self._model.nominal_state()
        foot = self._model.foot_positions(standing)[0]
        footholds = (FootholdTarget(0, 0.1, 0.3, foot, mpc_swings.UP),)
        schedule = ContactSchedule(np.array([0.1, 0.3]), np.array([[True] * 4, [False, True, True, True], [True] * 4]))
        times, states = np.array([0.0, 1.0]), np.tile(standing, (2, 1))
        reference = WholeBodyReference(0.0, 0, times, states, np.zeros((2, INPUT_SIZE)), schedule, footholds)
        memory = MpcMemory.empty()
        for _ in range(2):
            memory = self._next(state, reference, memory, None)

    def compute(
        self,
        state: RobotState,
        reference: WholeBodyReference,
        memory: MpcMemory,
        solver: SolverInterface | None = None,
        ground: SignedDistance | None = None,
    ) -> MpcMemory:
        """One solve from the measured ``state``. A failure carries the last policy on and is counted in it.

        Args:
            state: where the prediction starts.
            reference: what to track; without samples: stand.
            memory: of the last solve.
            solver: another back-end than the configured one, for this time.
            ground: its signed distance; it counts only if the configuration says so.
        """
        return self._next(state, reference, memory, solver, ground)

    def _next(self, state, reference, memory, solver, ground=None) -> MpcMemory:
        start = clock.perf_counter()
        last, now = memory.policy, state.stamp
        gave_up = memory.consecutive_failures > self._config.max_consecutive_failures
        standing = memory.standing
        if len(reference.times) > 1 and not gave_up:
            standing, schedule, footholds = None, reference.schedule, reference.footholds
        else:
            standing = standing or horizon.standing_pose(state, self._robot)
            schedule, footholds = ContactSchedule.standing(), ()
        feet = self._feet(state, schedule, memory)
        normals = mpc_swings.standing_normals(footholds, memory.normals, now)
        times = now + self._offsets
        x0 = self._model.state_from_robot_state(state)
        moved = self._shifts(x0, reference, footholds, feet, memory, now)
        footholds = foothold_shift.shifted(footholds, moved)
        swings = self._swings.plan(schedule, footholds, feet, normals, now, times[-1], last.swings)
        stance = horizon.interval_stance(schedule, times)
        stance = horizon.with_early_contacts(stance, times, state.contacts, swings, self._early_contact_phase)
        task = self._task(times, state, reference, standing, stance, swings, feet, normals, footholds)
        if self._config.ocp.sdf_clearance.enabled:
            task.ground = ground
        solution = self._problem.iterate(x0, task, self._guess(x0, task, last), solver)
        memory = replace(memory, feet=feet, normals=normals, standing=standing, shifts=moved)
        if not solution.success:
            policy = _carried_on(last, solution.status, clock.perf_counter() - start)
            return replace(memory, policy=policy, consecutive_failures=memory.consecutive_failures + 1)
        policy = MpcPolicy(
            stamp=now,
            times=times,
            states=solution.X,
            inputs=solution.U,
            base_twists=self._model.base_twists(solution.X, solution.U),
            schedule=schedule,
            swings=mpc_swings.with_finished(swings, last.swings, now),
            normals=task.surface_normal[0],
            success=True,
            status=solution.status,
            fallbacks=last.fallbacks,
            solve_time=clock.perf_counter() - start,
        )
        return replace(memory, policy=policy, consecutive_failures=0)

    def _feet(self, state: RobotState, schedule: ContactSchedule, memory: MpcMemory) -> np.ndarray:
        """Feet on the ground: where they are. Feet in the air: where they left it."""
        measured = self._robot.foot_positions_W(state)
        if memory.policy.is_empty:
            return measured
        return np.where(schedule.at(state.stamp)[:, None], measured, memory.feet)

    def _shifts(self, x0, reference, footholds, feet, memory, now) -> tuple:
        """Where the coming footholds move to; nowhere by default."""
        config = self._config.footholds
        if config.max_shift == 0.0 or not footholds:
            return ()
        wanted = interpolated(np.array([now]), reference.times, reference.states)[0]
        height = float(x0[CentroidalState.POSITION][2] - feet[:, 2].mean())
        error = foothold_shift.capture_point_error(x0, wanted, height)
        return foothold_shift.shifts(error, footholds, memory.shifts, now, config)

    def _task(self, times, state, reference, standing, stance, swings, feet, normals, footholds) -> TrackingTask:
        if standing is not None:
            x_ref, u_ref = horizon.standing_samples(standing, self._robot, len(stance))
        else:
            x_ref = horizon.sampled_states(reference, times, float(state.rpy_WB[2]))
            u_ref = horizon.weight_bearing_inputs(stance, self._robot.mass)
        foot_p, foot_v = mpc_swings.foot_references(swings, feet, times)
        region_normals, region_offsets = mpc_swings.foothold_halfspaces(footholds, times)
        return TrackingTask(
            times=times,
            x_ref=x_ref,
            u_ref=u_ref,
            stance=stance,
            foot_ref_p=foot_p,
            foot_ref_v=foot_v,
            surface_normal=mpc_swings.ground_normals(footholds, normals, times),
            halfspace_normals=region_normals,
            halfspace_offsets=region_offsets,
        )

    def _guess(self, x0: np.ndarray, task: TrackingTask, last: MpcPolicy) -> tuple[np.ndarray, np.ndarray]:
        """The last solution at the new knots; at the very first, standing still."""
        if last.is_empty:
            return np.tile(x0, (len(task.times), 1)), task.u_ref
        X = interpolated(task.times, last.times, last.states)
        U = horizon.held_inputs(task.times, task.stance, task.u_ref, last.times, last.inputs)
        yaw = CentroidalState.YAW
        X[:, yaw] += whole_turns(x0[yaw] - X[0, yaw])
        return X, U


def _carried_on(last: MpcPolicy, status: str, elapsed: float) -> MpcPolicy:
    """The last policy, marked as such; whole-body control reads it at later times."""
    return replace(last, success=False, status=status, fallbacks=last.fallbacks + 1, solve_time=elapsed)


__all__ = ["MpcConfig", "MpcMemory", "RealTimeIteration"]
