"""Whole-body control: joint torques that follow the MPC policy and obey the robot's rigid-body dynamics."""

import time as clock
from dataclasses import replace

import numpy as np

from quadpips_drake.control.whole_body import whole_body_tasks as tasks
from quadpips_drake.control.whole_body.contact_logic import FootTargets, foot_targets
from quadpips_drake.control.whole_body.robot_dynamics import RobotDynamics
from quadpips_drake.control.whole_body.whole_body_assembly import AssemblySettings, assembled_matrices, stands_for
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.control.whole_body.whole_body_methods import MethodSolution, WholeBodyProgram, make_method, not_a_number
from quadpips_drake.control.whole_body.whole_body_targets import base_acceleration, joint_targets, redistributed
from quadpips_drake.control.whole_body.whole_body_tick import CompiledTick
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.legs import NUM_JOINTS, NUM_LEGS
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.whole_body_command import FootMode, WholeBodyCommand


class TaskSpaceInverseDynamics:
    """Tasks on z = [vdot, f], ranked strictly or by weight (QuadPiPS section VII-C).

    Constraints: the floating base's dynamics, friction pyramids about each foot's ground normal, no force on feet in the
    air, joint torque limits, joint stops (optional, soft). Tasks in falling order: stance feet do not accelerate; swing feet
    follow their splines; the base follows the policy's pose and twist; forces are the policy's. The constraints can always
    be met (f = 0 with the joints limp satisfies them), so a failure is a numerical one.

    A class that derives from this one may change ``program``, for instance add a level; every method then solves that.
    """

    def __init__(self, robot, config: WbcConfig | None = None):
        self._robot = robot
        self._config = config or WbcConfig()
        self._dynamics = RobotDynamics(robot)
        limits = tasks.FORCE_ROWS * NUM_LEGS + NUM_JOINTS
        self._method = make_method(self._config, tasks.NUM_VARIABLES, 6, limits, NUM_JOINTS)
        self._efforts = np.asarray(robot.effort_limits, dtype=float)
        # Forces are two orders of magnitude larger than accelerations: their columns are scaled by the mass for the solver.
        self._scale = np.concatenate((np.ones(tasks.NUM_VELOCITIES), np.full(tasks.NUM_FORCES, robot.mass)))
        self._tick = self._shortcut()

    def _shortcut(self) -> CompiledTick | None:
        """The compiled tick where its program says what ``program`` says, else None: then the tasks are solved."""
        if self._config.method != "weighted" or self._config.joint_stops:
            return None
        moving = 0.1 * np.arange(1.0, 4.0)
        state = replace(standing_state(self._robot), v_WB=moving, w_WB=-moving)
        dynamics = self._dynamics.evaluate(state)
        feet = np.arange(12.0).reshape(NUM_LEGS, 3)
        modes = np.array([FootMode.STANCE, FootMode.SWING, FootMode.EARLY, FootMode.SEARCH], dtype=int)
        targets = FootTargets(modes, dynamics.p_WF, dynamics.v_WF, feet)
        normals, base, forces = np.tile([0.6, 0.0, 0.8], (NUM_LEGS, 1)), np.arange(1.0, 7.0), 10.0 + feet
        normals.flags.writeable = False  # as those of a policy: compiled functions tell them apart
        program = self.program(state, normals, targets, dynamics, base, forces)
        settings = AssemblySettings.of(self._robot, self._config)
        assembled = assembled_matrices(settings, dynamics, targets, base, forces, normals)
        same = stands_for(program, self._method.matrices(program), assembled)
        return CompiledTick(self._robot, self._config) if same else None

    def compute(self, state: RobotState, policy: MpcPolicy, last: WholeBodyCommand) -> WholeBodyCommand:
        """One tick. ``last`` is the previous result: its solution starts this one, its torque stands in for a failed one."""
        start = clock.perf_counter()
        if not state.is_known:
            return replace(WholeBodyCommand.empty(), joint_positions=np.array(self._robot.nominal_joints), status="blind")
        if policy.is_empty:
            return self._stand(state, last, "standing", last.fallbacks, 0, start)
        solution, modes, commands = (self._by_tasks if self._tick is None else self._compiled)(state, policy, last)
        if not solution.success:
            return self._fall_back(state, modes, last, solution, start)
        torque, joint_positions, joint_velocities = commands
        return WholeBodyCommand(
            stamp=state.stamp,
            torque=torque,
            joint_positions=joint_positions,
            joint_velocities=joint_velocities,
            forces=solution.x[tasks.FORCE].reshape(NUM_LEGS, 3),
            foot_modes=modes,
            status=solution.status,
            success=solution.complete,
            fallbacks=last.fallbacks + (not solution.complete),
            consecutive_failures=0,
            iterations=solution.iterations,
            solve_time=clock.perf_counter() - start,
            warm=solution.warm,
        )

    def _compiled(self, state, policy, last) -> tuple[MethodSolution, np.ndarray, np.ndarray]:
        """Solution, FootModes, and torques, joint positions and velocities, by the compiled tick."""
        modes, where, good = self._tick.prepare(state, policy, last.foot_modes)
        if not good:
            return not_a_number(tasks.NUM_VARIABLES), modes, np.zeros((3, NUM_JOINTS))
        solution = self._method.solve_matrices(self._tick.matrices(), self._scale, last.warm)
        return solution, modes, self._tick.finish(solution.x, where)

    def _by_tasks(self, state, policy, last) -> tuple[MethodSolution, np.ndarray, tuple]:
        """The same, step by step."""
        dynamics, sample = self._dynamics.evaluate(state), policy.sample(state.stamp)
        targets = foot_targets(state, policy, sample.stance, last.foot_modes, dynamics.p_WF, dynamics.v_WF, self._config)
        base = base_acceleration(state, sample, dynamics, self._config)
        forces = redistributed(sample.forces, targets.contacts)
        solution = self._method.solve(self.program(state, policy.normals, targets, dynamics, base, forces), last.warm)
        torque_matrix, torque_bias = tasks.torque_map(dynamics)
        torque = np.clip(torque_matrix @ solution.x + torque_bias, -self._efforts, self._efforts)
        return solution, targets.modes, (torque, *joint_targets(state, sample, targets, dynamics))

    def program(self, state, normals, targets, dynamics, base, forces) -> WholeBodyProgram:
        """What is asked for, in the order of priority.

        Args:
            state, normals, targets, dynamics: measured state, unit normals (4, 3), FootTargets, DynamicsTerms.
            base: wanted acceleration of the base [angular, linear] in W, (6,).
            forces: wanted forces in W [N], (4, 3).
        """
        c, contacts = self._config, targets.contacts
        max_force = c.max_force_ratio * self._robot.mass * GRAVITY
        pyramids = tasks.friction_pyramids(normals, contacts, c.friction, max_force)
        wanted, calm = targets.accelerations, tasks.joint_acceleration(np.zeros(NUM_JOINTS))
        effort = (c.force_weight / self._robot.mass**2) * tasks.contact_forces(forces) + c.joint_weight * calm
        levels = (
            tasks.Level("contact", c.stance_weight, tasks.foot_acceleration(dynamics, wanted, contacts)),
            tasks.Level("swing", c.swing_weight, tasks.foot_acceleration(dynamics, wanted, ~contacts)),
            tasks.Level("base", c.base_weight, tasks.base_acceleration(base)),
            tasks.Level("forces", 1.0, effort),
        )
        A, b = tasks.floating_base_dynamics(dynamics)
        return WholeBodyProgram(
            equality_matrix=A,
            equality_target=b,
            airborne=np.concatenate((np.zeros(tasks.NUM_VELOCITIES, dtype=bool), np.repeat(~contacts, 3))),
            limits=pyramids + tasks.torque_limits(*tasks.torque_map(dynamics), self._efforts),
            levels=tuple(level for level in levels if len(level.task.target)),
            scale=self._scale,
            stops=self._stops(state) if c.joint_stops else None,
            stop_weight=c.joint_stop_weight,
        )

    def _stops(self, state: RobotState) -> tasks.Limits:
        c, robot = self._config, self._robot
        lower = robot.position_limits_lower + c.joint_stop_margin
        upper = robot.position_limits_upper - c.joint_stop_margin
        return tasks.joint_stops(state.joint_positions, state.joint_velocities, lower, upper, c.joint_stop_rate)

    def _fall_back(self, state, modes, last, solution, start) -> WholeBodyCommand:
        """The last torques with joint damping; after many failures in a row, standing by joint control."""
        failures = last.consecutive_failures + 1
        if failures > self._config.max_consecutive_failures or not np.isfinite(last.stamp):
            return self._stand(state, last, solution.status, last.fallbacks + 1, failures, start)
        damping = self._config.stand_damping * self._efforts
        return WholeBodyCommand(
            stamp=state.stamp,
            torque=np.clip(last.torque - damping * state.joint_velocities, -self._efforts, self._efforts),
            joint_positions=last.joint_positions,
            joint_velocities=np.zeros(NUM_JOINTS),
            forces=last.forces,
            foot_modes=modes,
            status=solution.status,
            success=False,
            fallbacks=last.fallbacks + 1,
            consecutive_failures=failures,
            iterations=solution.iterations,
            solve_time=clock.perf_counter() - start,
        )

    def _stand(self, state, last, status, fallbacks, failures, start) -> WholeBodyCommand:
        """Joint PD about the nominal stance, the robot's weight shared by all feet."""
        c, dynamics = self._config, self._dynamics.evaluate(state)
        nominal = np.asarray(self._robot.nominal_joints)
        forces = np.tile([0.0, 0.0, self._robot.mass * GRAVITY / NUM_LEGS], (NUM_LEGS, 1))
        torque = dynamics.bias[6:] - dynamics.foot_jacobian[:, 6:].T @ forces.ravel()
        torque = torque + self._efforts * (
            c.stand_stiffness * (nominal - state.joint_positions) - c.stand_damping * state.joint_velocities
        )
        return WholeBodyCommand(
            stamp=state.stamp,
            torque=np.clip(torque, -self._efforts, self._efforts),
            joint_positions=nominal,
            joint_velocities=np.zeros(NUM_JOINTS),
            forces=forces,
            foot_modes=np.full(NUM_LEGS, int(FootMode.STANCE)),
            status=status,
            success=failures == 0,
            fallbacks=fallbacks,
            consecutive_failures=failures,
            solve_time=clock.perf_counter() - start,
        )
