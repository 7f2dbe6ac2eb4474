"""Whole-body control: joint torques that follow the MPC policy and obey the robot's rigid-body dynamics."""

import time as clock
from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.control import whole_body_tasks as tasks
from quadpips_drake.control.contact_logic import FootMode, FootTargets, foot_targets
from quadpips_drake.control.mpc_policy import MpcPolicy, PolicySample
from quadpips_drake.control.robot_dynamics import DynamicsTerms, RobotDynamics
from quadpips_drake.control.whole_body_qp import QpSolution, make_whole_body_qp
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.legs import NUM_JOINTS, NUM_LEGS
from quadpips_drake.robots.robot_state import RobotState
from quadpips_drake.values import ImmutableValue

GRAVITY = 9.81
_MAX_JOINT_STEP = 0.3
"""Largest distance of joint set points from the measured joints [rad]."""


@dataclass
class WbcConfig:
    """Gains and weights of whole-body control. Weights multiply squared accelerations, so they compare one with another."""

    solver: str = "proxqp_dense"
    """Solver of the quadratic program: proxqp_dense (warm-started), or any of the registry (proxqp, osqp, clarabel, ...)."""
    friction: float = 0.6
    """Friction coefficient mu that the forces respect [1]."""
    max_force_ratio: float = 1.5
    """Largest normal force of one foot, as a multiple of the robot's weight [1]."""
    base_linear_kp: float = 60.0
    """[1/s^2]"""
    base_linear_kd: float = 12.0
    """[1/s]"""
    base_angular_kp: float = 150.0
    """[1/s^2]"""
    base_angular_kd: float = 20.0
    """[1/s]"""
    swing_kp: float = 550.0
    """[1/s^2] (QuadPiPS release: 550)"""
    swing_kd: float = 40.0
    """[1/s] (QuadPiPS release: 50)"""
    stance_damping: float = 20.0
    """Decelerates a stance foot that slides [1/s]."""
    search_speed: float = 0.4
    """How fast a foot that misses its ground is lowered [m/s]."""
    search_depth: float = 0.12
    """How far below its foothold it is lowered at most [m]."""
    early_contact_phase: float = 0.6
    """From this part of a swing on a touch counts as touch-down [1]."""
    base_weight: float = 1.0
    """Of errors of the base's acceleration [s^4/m^2, s^4/rad^2]."""
    stance_weight: float = 500.0
    """Of accelerations of feet on the ground [s^4/m^2]."""
    swing_weight: float = 100.0
    """Of errors of the acceleration of feet in the air [s^4/m^2]."""
    force_weight: float = 0.2
    """Of force errors divided by the robot's mass [s^4/m^2]."""
    joint_weight: float = 1e-5
    """Of the joints' accelerations, to keep them small [s^4/rad^2]."""
    stand_stiffness: float = 2.5
    """Joint stiffness without a policy, as a multiple of the effort limit [1/rad]."""
    stand_damping: float = 0.06
    """Joint damping without a policy, as a multiple of the effort limit [s/rad]."""
    max_consecutive_failures: int = 10
    """After so many failed programs in a row the robot stands by joint control alone."""

    def __post_init__(self):
        for name in (
            "friction",
            "max_force_ratio",
            "base_weight",
            "stance_weight",
            "swing_weight",
            "force_weight",
            "joint_weight",
        ):
            if getattr(self, name) <= 0.0:
                raise UserInputError(f"whole_body_controller.{name} must be positive, is {getattr(self, name)}")


@dataclass(frozen=True, eq=False)
class WholeBodyCommand(ImmutableValue):
    """Result of one tick of whole-body control."""

    stamp: float
    """[s]"""
    torque: np.ndarray
    """Feedforward joint torques [N m], (12,)."""
    joint_positions: np.ndarray
    """Set points of the joints' own PD control [rad], (12,)."""
    joint_velocities: np.ndarray
    """[rad/s], (12,)."""
    forces: np.ndarray
    """Ground forces that the torques aim at, in W [N], (4, 3)."""
    foot_modes: np.ndarray
    """FootMode of each foot, int (4,)."""
    status: str
    """"standing" without a policy, else the solver's word."""
    success: bool
    fallbacks: int
    """How many programs have failed since the start."""
    consecutive_failures: int
    iterations: int = 0
    solve_time: float = 0.0
    """Wall-clock time of the tick [s]."""
    warm: QpSolution | None = field(default=None, repr=False)
    """Where the next program starts from."""

    @staticmethod
    def empty() -> "WholeBodyCommand":
        zeros = np.zeros(NUM_JOINTS)
        down = np.full(NUM_LEGS, int(FootMode.STANCE))
        return WholeBodyCommand(-np.inf, zeros, zeros, zeros, np.zeros((NUM_LEGS, 3)), down, "none", True, 0, 0)


class WholeBodyControl:
    """Weighted quadratic program over z = [vdot, f] (QuadPiPS section VII-C, with weights in place of a strict hierarchy).

    Constraints: the floating base's dynamics, friction pyramids about each foot's ground normal, no force on feet in the
    air, joint torque limits. Wishes, by falling weight: stance feet do not accelerate; swing feet follow their splines; the
    base follows the policy's pose and twist; forces are the policy's. The QP can always be met (f = 0 with the joints limp
    satisfies every constraint), so a failure is a numerical one.
    """

    def __init__(self, robot, config: WbcConfig | None = None):
        self._robot = robot
        self._config = config or WbcConfig()
        self._dynamics = RobotDynamics(robot)
        self._qp = make_whole_body_qp(self._config.solver, tasks.NUM_VARIABLES, 6, 5 * NUM_LEGS + NUM_JOINTS)
        self._efforts = np.asarray(robot.effort_limits, dtype=float)

    def compute(self, state: RobotState, policy: MpcPolicy, last: WholeBodyCommand) -> WholeBodyCommand:
        """One tick. ``last`` is the previous result: its solution starts this one, its torque stands in for a failed one."""
        start = clock.perf_counter()
        dynamics = self._dynamics.evaluate(state)
        if policy.is_empty:
            return self._stand(state, dynamics, last, "standing", last.fallbacks, 0, start)
        sample = policy.sample(state.stamp)
        targets = foot_targets(state, policy, sample.stance, last.foot_modes, dynamics.p_WF, dynamics.v_WF, self._config)
        solution, forces, torque = self._solve(state, policy, sample, targets, dynamics, last.warm)
        if not solution.success:
            return self._fall_back(state, targets, last, solution, dynamics, start)
        joint_positions, joint_velocities = joint_targets(state, sample, targets, dynamics)
        return WholeBodyCommand(
            stamp=state.stamp,
            torque=torque,
            joint_positions=joint_positions,
            joint_velocities=joint_velocities,
            forces=forces,
            foot_modes=targets.modes,
            status=solution.status,
            success=True,
            fallbacks=last.fallbacks,
            consecutive_failures=0,
            iterations=solution.iterations,
            solve_time=clock.perf_counter() - start,
            warm=solution,
        )

    def _solve(self, state, policy, sample, targets, dynamics, warm) -> tuple[QpSolution, np.ndarray, np.ndarray]:
        """The program's solution, and from it forces (4, 3) [N] and torques (12,) [N m]."""
        c = self._config
        weight = self._robot.mass * GRAVITY
        airborne = np.repeat(~targets.contacts, 3)
        wishes = (
            np.where(airborne, c.swing_weight, c.stance_weight) * tasks.foot_acceleration(dynamics, targets.accelerations)
            + c.base_weight * tasks.base_acceleration(self._base_acceleration(state, sample, dynamics))
            + (c.force_weight / self._robot.mass**2) * tasks.contact_forces(redistributed(sample.forces, targets.contacts))
            + c.joint_weight * tasks.joint_acceleration(np.zeros(NUM_JOINTS))
        )
        torque_matrix, torque_bias = tasks.torque_map(dynamics)
        limits = tasks.friction_pyramids(
            policy.normals, targets.contacts, c.friction, c.max_force_ratio * weight
        ) + tasks.torque_limits(torque_matrix, torque_bias, self._efforts)
        A, b = tasks.floating_base_dynamics(dynamics)
        # Forces are two orders of magnitude larger than accelerations: their columns are scaled by the mass for the solver.
        scale = np.concatenate((np.ones(tasks.NUM_VELOCITIES), np.full(tasks.NUM_FORCES, self._robot.mass)))
        wish = wishes.matrix * scale
        solution = self._qp.solve(
            wish.T @ wish, -wish.T @ wishes.target, A * scale, b, limits.matrix * scale, limits.lower, limits.upper, warm
        )
        z = scale * solution.x
        torque = np.clip(torque_matrix @ z + torque_bias, -self._efforts, self._efforts)
        return solution, z[tasks.FORCE].reshape(NUM_LEGS, 3), torque

    def _base_acceleration(self, state: RobotState, sample: PolicySample, dynamics: DynamicsTerms) -> np.ndarray:
        """[angular, linear] in W: what the policy's forces do to the robot with locked joints, plus PD about its pose."""
        c = self._config
        wrench = dynamics.foot_jacobian[:, :6].T @ sample.forces.ravel() - dynamics.bias[:6]
        feedforward = np.linalg.solve(dynamics.mass_matrix[:6, :6], wrench)
        linear = c.base_linear_kp * (sample.p_WB - state.p_WB) + c.base_linear_kd * (sample.v_WB - state.v_WB)
        error = rotation_error(sample.rpy_WB, state.R_WB)
        angular = c.base_angular_kp * error + c.base_angular_kd * (sample.w_WB - state.w_WB)
        return feedforward + np.concatenate((angular, linear))

    def _fall_back(self, state, targets, last, solution, dynamics, start) -> WholeBodyCommand:
        """The last torques with joint damping; after many failures in a row, standing by joint control."""
        failures = last.consecutive_failures + 1
        if failures > self._config.max_consecutive_failures or not np.isfinite(last.stamp):
            return self._stand(state, dynamics, last, solution.status, last.fallbacks + 1, failures, start)
        damping = self._config.stand_damping * self._efforts
        return WholeBodyCommand(
            stamp=state.stamp,
            torque=np.clip(last.torque - damping * state.joint_velocities, -self._efforts, self._efforts),
            joint_positions=last.joint_positions,
            joint_velocities=np.zeros(NUM_JOINTS),
            forces=last.forces,
            foot_modes=targets.modes,
            status=solution.status,
            success=False,
            fallbacks=last.fallbacks + 1,
            consecutive_failures=failures,
            iterations=solution.iterations,
            solve_time=clock.perf_counter() - start,
        )

    def _stand(self, state, dynamics, last, status, fallbacks, failures, start) -> WholeBodyCommand:
        """Joint PD about the nominal stance, the robot's weight shared by all feet."""
        c = self._config
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


def joint_targets(
    state: RobotState, sample: PolicySample, targets: FootTargets, dynamics: DynamicsTerms
) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions [rad] and velocities [rad/s] that put the feet where they should be, (12,) each.

    The joints' own PD control then pulls in the direction of the swing and damps about the planned motion: positions are one
    Newton step of inverse kinematics away from the measured ones (on the ground: none), velocities those of the wanted feet
    under a base that moves as planned.
    """
    twist = np.concatenate((sample.w_WB, sample.v_WB))
    base_part = (dynamics.foot_jacobian[:, :6] @ twist).reshape(NUM_LEGS, 3)
    wanted = np.stack((targets.positions - dynamics.p_WF, targets.velocities - base_part), axis=2)
    legs = np.stack([dynamics.foot_jacobian[3 * i : 3 * i + 3, 6 + 3 * i : 9 + 3 * i] for i in range(NUM_LEGS)])
    # Damped least squares: finite where a leg is stretched out.
    transposed = legs.transpose(0, 2, 1)
    steps = np.linalg.solve(transposed @ legs + 1e-4 * np.eye(3), transposed @ wanted)
    position_step = np.clip(steps[:, :, 0].ravel(), -_MAX_JOINT_STEP, _MAX_JOINT_STEP)
    return state.joint_positions + position_step, steps[:, :, 1].ravel()


def redistributed(forces: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """The policy's forces (4, 3) [N] when only ``contacts`` bear: what the others should carry is shared among them."""
    if np.all(contacts) or not np.any(contacts):
        return forces
    wanted = np.where(contacts[:, None], forces, 0.0)
    missing = forces[~contacts].sum(axis=0)
    return wanted + np.where(contacts[:, None], missing / contacts.sum(), 0.0)


def rotation_error(rpy_desired: np.ndarray, R_WB: np.ndarray) -> np.ndarray:
    """Small rotation in W that turns ``R_WB`` into the desired attitude [rad], (3,)."""
    R = rotation_matrix(rpy_desired) @ R_WB.T
    # Twice the vector part of the quaternion: exact to third order, and finite for any error.
    vee = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return vee * 2.0 / np.sqrt(max(1.0 + np.trace(R), 1e-2))


def rotation_matrix(rpy: np.ndarray) -> np.ndarray:
    """R = Rz(yaw) Ry(pitch) Rx(roll), (3, 3)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
