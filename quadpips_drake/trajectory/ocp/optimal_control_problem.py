"""The optimal control problem of QuadPiPS (eq. 19), solved by sequential quadratic programming.

One formulation serves the swing optimiser (to convergence) and the model-predictive controller (one iteration).
"""

import time
from dataclasses import replace

import numpy as np

from quadpips_drake.math.angles import whole_turns
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.sensing.robot_shapes import trunk_corners
from quadpips_drake.solvers.registry import make_solver
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.ocp.knot_kernels import OcpParameters, approximate_knots, make_blocks
from quadpips_drake.trajectory.ocp.knot_values import evaluate_knots
from quadpips_drake.trajectory.ocp.ocp_config import OcpConfig, SdfClearanceConfig, TrajectoryOcpConfig
from quadpips_drake.trajectory.ocp.reduction import unpacked
from quadpips_drake.trajectory.ocp.stage_program import StageProgram
from quadpips_drake.trajectory.ocp.terms.terminal_cost import regulator_cost, turned_to_yaw
from quadpips_drake.trajectory.ocp.tracking_task import Guess, OcpSolution, TrackingTask, shift_guess
from quadpips_drake.values.centroidal import STATE_SIZE, CentroidalState

_YAW = CentroidalState.YAW
_FORCE_UNIT_PER_WEIGHT = 0.2
_REGULATOR_STEP = 0.02
_MIN_STEP_LENGTH = 1e-2


class OptimalControlProblem:
    """Tracks a reference with the centroidal model, by direct multiple shooting on any grid of N intervals.

        min  sum_k dt_k L(x_k, u_k) + |x_N - x_des|^2_Qf   s.t.  (19a) dynamics, (19b) feet, (19c) friction, (19d) zero force

    Dynamics: midpoint rule. Friction polyhedra are hard inequalities; joint and foothold limits (19e, 19f) are relaxed
    barriers, so every quadratic program has a solution. Foot velocities and zero forces are eliminated (see projection). The
    Hessian is Gauss-Newton's. ``terms/`` holds one file per term.

    The object keeps buffers, but no memory: equal arguments give equal results.
    """

    def __init__(
        self,
        model: CentroidalModel,
        config: TrajectoryOcpConfig,
        num_knots: int,
        terminal_cost: np.ndarray | None = None,
    ):
        """
        Args:
            model: of the robot.
            config: settings; ``iterate`` needs an OcpConfig.
            num_knots: of every task.
            terminal_cost: of another problem with the same model and settings, which need not be worked out again.
        """
        self.model, self.config, self.num_knots = model, config, num_knots
        self._parameters = _parameters(model, config)
        self._program = StageProgram(num_knots)
        self._blocks = self._program.blocks
        self._solver = make_solver(config.solver, config.qp_tolerance)
        self.terminal_cost = self._regulator_cost() if terminal_cost is None else terminal_cost
        """Q_f (24, 24), for a robot that faces x."""

    @property
    def program(self) -> StageProgram:
        """The quadratic program, as the last iteration left it; for onlookers."""
        return self._program

    def initial_guess(self, x0, task: TrackingTask) -> Guess:
        """Returns the reference itself, moved to start at ``x0``'s pose, as the point to linearise about."""
        states = np.array(task.x_ref, dtype=float)
        states[0] = x0
        return Guess(states, np.array(task.u_ref, dtype=float), np.asarray(task.times, dtype=float))

    def iterate(self, x0, task: TrackingTask, guess: Guess | OcpSolution | tuple | None = None, solver=None) -> OcpSolution:
        """One real-time iteration from state ``x0`` (24,): linearise about the guess, solve, take the step.

        Without a guess it starts from the reference; a pair (X, U) is a guess on the task's own times. A step that would
        move a pose coordinate or joint by more than ``max_step`` is scaled down. When the quadratic program fails, the guess
        comes back with ``success`` False. ``solver`` takes the place of the configured one (studies of faults).
        """
        states, inputs, x0, task = self._start(x0, task, guess)
        clock = _Clock()
        arrays = task.arrays(self.config.friction)
        cost, violation = self._approximate(arrays, states, inputs, clock)
        step = self._solve_quadratic(arrays, x0, states, clock, solver)
        solution = OcpSolution(
            step is not None,
            "iteration",
            states,
            inputs,
            arrays.times,
            1,
            clock.qp_iterations,
            cost,
            violation,
            **clock.times,
        )
        if step is None:
            return replace(solution, status=f"quadratic program: {clock.failure}")
        largest = np.abs(step[0][:, CentroidalState.CONFIGURATION]).max()
        length = min(1.0, self.config.max_step / max(largest, 1e-12))
        return replace(solution, X=states + length * step[0], U=inputs + length * step[1])

    def solve(
        self,
        x0,
        task: TrackingTask,
        guess: Guess | OcpSolution | tuple | None = None,
        max_iterations: int = 25,
        tol: float = 1e-4,
    ) -> OcpSolution:
        """Iterates to convergence, with a filter line search: a step must lessen the cost or the constraint violation.

        Converged means: the last full step changed the state by less than ``tol`` (root mean square), or the cost by less
        than ``tol`` relatively, at a violation below 10 ``tol``.
        """
        states, inputs, x0, task = self._start(x0, task, guess)
        states[0] = x0
        clock = _Clock()
        arrays = task.arrays(self.config.friction)
        cost, violation = self._approximate(arrays, states, inputs, clock)
        status, iterations = "iteration limit", 0
        while iterations < max_iterations:
            iterations += 1
            step = self._solve_quadratic(arrays, x0, states, clock)
            if step is None:
                status = f"quadratic program: {clock.failure}"
                break
            trial = self._line_search(arrays, states, inputs, step, cost, violation, clock)
            if trial is None:
                status = "converged" if violation < 10 * tol and _size(step[0]) < 10 * tol else "line search failed"
                break
            change = abs(trial[2] - cost) / max(1.0, abs(cost))
            length, (states, inputs, cost, violation) = trial[4], trial[:4]
            if violation < 10 * tol and length == 1.0 and (_size(step[0]) < tol or change < tol):
                status = "converged"
                break
            if iterations < max_iterations:
                cost, violation = self._approximate(arrays, states, inputs, clock)
        return OcpSolution(
            status == "converged",
            status,
            states,
            inputs,
            arrays.times,
            iterations,
            clock.qp_iterations,
            cost,
            violation,
            **clock.times,
        )

    def _start(self, x0, task, guess):
        if task.num_knots != self.num_knots:
            raise ValueError(f"this problem has {self.num_knots} knots, the task {task.num_knots}")
        # Yaw may differ by whole turns between measurement, reference and guess; the reference decides.
        x0 = np.array(x0, dtype=float)
        x0[_YAW] += whole_turns(task.x_ref[0, _YAW] - x0[_YAW])
        if guess is None:
            guess = self.initial_guess(x0, task)
        elif isinstance(guess, tuple):
            guess = Guess(*guess, np.asarray(task.times, dtype=float))
        elif not np.array_equal(guess.times, task.times):
            guess = shift_guess(guess, task.times)
        states = np.array(guess.X, dtype=float)
        states[:, _YAW] += whole_turns(x0[_YAW] - states[0, _YAW])
        return states, np.array(guess.U, dtype=float), x0, task

    def _approximate(self, arrays, states, inputs, clock):
        """Fills the blocks. Returns cost and constraint violation."""
        start = time.perf_counter()
        approximate_knots(self._parameters, arrays, states, inputs, self._blocks)
        self._terminal_hessian = turned_to_yaw(self.terminal_cost, arrays.x_ref[-1, _YAW])
        cost = self._blocks.costs.sum() + self._terminal(arrays, states)
        clock.times["linearisation_time"] += time.perf_counter() - start
        return float(cost), float(np.sqrt(self._blocks.violations.sum()))

    def _evaluate(self, arrays, states, inputs, clock):
        """Returns cost and constraint violation; the blocks stay as they are."""
        start = time.perf_counter()
        cost, squared = evaluate_knots(self._parameters, arrays, states, inputs)
        cost += self._terminal(arrays, states)
        clock.times["linearisation_time"] += time.perf_counter() - start
        return float(cost), float(np.sqrt(squared))

    def _terminal(self, arrays, states):
        error = states[-1] - arrays.x_ref[-1]
        return 0.5 * error @ self._terminal_hessian @ error

    def _solve_quadratic(self, arrays, x0, states, clock, solver=None):
        """Returns the step (dX, dU) or None."""
        start = time.perf_counter()
        error = states[-1] - arrays.x_ref[-1]
        self._program.update(x0 - states[0], self._terminal_hessian, self._terminal_hessian @ error)
        update_time = time.perf_counter() - start
        solution, details = self._program.solve(solver or self._solver)
        clock.times["assembly_time"] += update_time + details.conversion_time
        clock.times["qp_time"] += details.solve_time
        clock.qp_iterations += details.iterations
        if not details.success:
            clock.failure = details.status
            return None
        state_steps, input_steps = self._program.steps(solution)
        state_steps[0] = x0 - states[0]  # known, however tolerant the solver
        return state_steps, input_steps

    def _line_search(self, arrays, states, inputs, step, cost, violation, clock):
        """Returns (states, inputs, cost, violation, step length) of the first acceptable trial, or None."""
        length = 1.0
        while length >= _MIN_STEP_LENGTH:
            trial_states, trial_inputs = states + length * step[0], inputs + length * step[1]
            trial_cost, trial_violation = self._evaluate(arrays, trial_states, trial_inputs, clock)
            lessens_violation = trial_violation < (1.0 - 1e-2 * length) * violation
            lessens_cost = trial_cost < cost - 1e-6 * abs(cost)
            if np.isfinite(trial_cost) and (
                (violation > 1e-2 and (lessens_violation or (lessens_cost and trial_violation < 1.1 * violation)))
                or (violation <= 1e-2 and trial_violation <= 1e-2 and trial_cost < cost + 1e-3 * abs(cost))
            ):
                return trial_states, trial_inputs, trial_cost, trial_violation, length
            length *= 0.5
        return None

    def _regulator_cost(self):
        """Q_f: cost-to-go of standing at the nominal joints on four feet."""
        if self.config.terminal_cost_scale == 0.0:
            return np.zeros((STATE_SIZE, STATE_SIZE))
        x, u = self.model.nominal_state(), self.model.gravity_compensation(np.ones(4))
        feet = self.model.foot_positions(x)
        task = TrackingTask(
            times=np.array([0.0, _REGULATOR_STEP]),
            x_ref=np.array([x, x]),
            u_ref=u[None],
            stance=np.ones((1, 4), dtype=bool),
            foot_ref_p=np.array([feet, feet]),
            foot_ref_v=np.zeros((2, 4, 3)),
            surface_normal=np.tile([0.0, 0.0, 1.0], (1, 4, 1)),
        )
        blocks = make_blocks(1)
        approximate_knots(self._parameters, task.arrays(self.config.friction), np.array([x, x]), u[None], blocks)
        dynamics = blocks.dynamics[0]
        steps = round(self.config.terminal_horizon / _REGULATOR_STEP)
        cost = regulator_cost(dynamics[:, :STATE_SIZE], dynamics[:, STATE_SIZE:], unpacked(blocks.hessian[0]), steps)
        return self.config.terminal_cost_scale * cost


class _Clock:
    """Adds up where the time of one solve goes."""

    def __init__(self):
        self.times = {"linearisation_time": 0.0, "assembly_time": 0.0, "qp_time": 0.0}
        self.qp_iterations = 0
        self.failure = ""


def _size(steps):
    return float(np.sqrt(np.mean(steps * steps)))


def _parameters(model, config):
    weights, robot = config.weights, model.robot
    # Angular momentum / mass per rad/s, so that its weight means one on angular velocity.
    lever = np.diag(model.locked_inertia(robot.nominal_joints)) / model.mass
    turning = np.asarray(weights.angular_velocity) / lever**2
    state_weights = np.concatenate(
        (
            weights.linear_velocity,
            [0.0, 0.0, turning[2]],  # about x and y: see add_angular_momentum_tracking
            weights.base_position,
            weights.base_orientation,
            np.tile(weights.joint_position, 4),
        )
    )
    clearance = config.sdf_clearance if isinstance(config, OcpConfig) else SdfClearanceConfig()
    corners = trunk_corners(robot) if clearance.enabled else np.zeros((0, 3))
    barriers = (config.joint_position_barrier, config.joint_velocity_barrier, config.joint_torque_barrier)
    return OcpParameters(
        model.tree,
        state_weights.astype(float),
        np.concatenate((np.tile(weights.contact_force, 4), np.tile(weights.joint_velocity, 4))).astype(float),
        turning[:2].astype(float),
        np.array(weights.foot_position, dtype=float),
        np.array(weights.foot_velocity, dtype=float),
        *((float(b.mu), float(b.delta)) for b in (*barriers, config.foothold_barrier)),
        np.array(robot.position_limits_lower, dtype=float),
        np.array(robot.position_limits_upper, dtype=float),
        -np.array(robot.velocity_limits, dtype=float),
        np.array(robot.velocity_limits, dtype=float),
        config.torque_limit_factor * np.array(robot.effort_limits, dtype=float),
        float(config.stance_position_gain),
        float(config.swing_error_gain),
        int(config.swing_constraint_directions),
        float(config.min_normal_force),
        float(_FORCE_UNIT_PER_WEIGHT * model.mass * GRAVITY),
        (float(clearance.barrier.mu), float(clearance.barrier.delta), float(clearance.reach)),
        (float(clearance.knee_radius), float(clearance.trunk_radius)),
        corners,
    )


__all__ = ["Guess", "OcpConfig", "OcpSolution", "OptimalControlProblem", "TrackingTask", "shift_guess"]
