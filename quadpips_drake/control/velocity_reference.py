"""A whole-body reference out of a velocity command: walking on flat ground without a planner."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from quadpips_drake.control.gaits import Gait
from quadpips_drake.control.mpc_horizon import weight_bearing_inputs
from quadpips_drake.control.reference_publisher import no_reference
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.legs import NUM_JOINTS, Leg
from quadpips_drake.robots.robot_state import RobotState
from quadpips_drake.trajectory.reference import ContactSchedule, FootholdTarget, WholeBodyReference
from quadpips_drake.values import ImmutableValue

GRAVITY = 9.81
STILL = 1e-3
"""Commands below this [m/s, rad/s] mean standing."""


@dataclass
class VelocityReferenceConfig:
    """How a velocity command becomes a reference."""

    horizon: float = 1.8
    """Length of the reference [s]; longer than the MPC's horizon plus a swing."""
    sample_time: float = 0.05
    """Distance of its samples [s]."""
    start_delay: float = 0.3
    """From the first command to the first lift-off [s]."""
    max_acceleration: float = 0.5
    """How fast the commanded velocity is taken up [m/s^2]."""
    max_yaw_acceleration: float = 1.0
    """[rad/s^2]"""
    leash: float = 0.10
    """Largest distance of the reference from the robot [m]."""
    yaw_leash: float = 0.2
    """[rad]"""
    velocity_feedback: float = 0.5
    """Raibert's correction of footholds, as part of sqrt(height / gravity) [1]."""
    max_correction: float = 0.15
    """Largest correction of a foothold [m]."""
    max_stride_ratio: float = 0.45
    """How far a foot may move ahead of its hip and behind it, as part of the hip's height [1]; commands that need more in
    the given gait are scaled down."""
    ground_filter_time: float = 0.2
    """Time constant of the estimated ground height [s]."""

    def __post_init__(self):
        for name in ("horizon", "sample_time", "max_acceleration", "max_yaw_acceleration", "ground_filter_time"):
            if getattr(self, name) <= 0.0:
                raise UserInputError(f"velocity_reference.{name} must be positive, is {getattr(self, name)}")


@dataclass(frozen=True, eq=False)
class WalkMemory(ImmutableValue):
    """What a walk by velocity command remembers from one update to the next."""

    stamp: float
    """[s]"""
    pose: np.ndarray
    """Reference x, y [m], yaw [rad], (3,)."""
    velocity: np.ndarray
    """Velocity taken up so far: forward, left [m/s], yaw rate [rad/s], (3,)."""
    ground: float
    """Height of the ground under the feet [m]."""
    gait_start: float = np.inf
    """Beginning of the first gait cycle [s]; infinite while standing."""
    gait_stop: float = np.inf
    """The walk ends with the first complete cycle after this time [s]."""
    reference: WholeBodyReference = None
    """Result of the update."""

    @staticmethod
    def empty() -> "WalkMemory":
        return WalkMemory(-np.inf, np.zeros(3), np.zeros(3), 0.0, reference=no_reference())


class VelocityWalk:
    """Rolling reference: the base moves with the command, feet come down where Raibert's rule wants them.

    A foot is placed where its nominal foothold lies below the reference base in the middle of the coming stance, plus
    k sqrt(h / g) (v - v_ref) (M. Raibert, Legged Robots That Balance, 1986), on the plane z = height of the present stance
    feet.
    """

    def __init__(self, robot, gait: Gait, config: VelocityReferenceConfig | None = None):
        self._robot = robot
        self._gait = gait
        self._config = config or VelocityReferenceConfig()
        self._footholds_B = robot.nominal_footholds_B
        self._height = -float(self._footholds_B[:, 2].mean())
        self._max_speed = 2.0 * self._config.max_stride_ratio * self._height / longest_stance(gait)

    def update(self, memory: WalkMemory, state: RobotState, command: np.ndarray) -> WalkMemory:
        """Next memory, with the reference from ``state.stamp`` on.

        Args:
            memory: result of the last update.
            state: measured state.
            command: forward, left [m/s], yaw rate [rad/s] in the robot's heading frame, (3,).
        """
        c = self._config
        now = state.stamp
        if not np.isfinite(memory.stamp):
            pose = np.array([*self._stance_centre(state), state.rpy_WB[2]])
            memory = WalkMemory(now, pose, np.zeros(3), self._feet(state)[:, 2].mean() - self._robot.foot_radius)
        dt = now - memory.stamp
        start, stop = self._phase(memory, command, now)
        moving = now >= start
        command = self._feasible(command)
        step = dt * np.array([c.max_acceleration, c.max_acceleration, c.max_yaw_acceleration])
        velocity = memory.velocity + (np.clip(command - memory.velocity, -step, step) if moving else 0.0)
        pose = memory.pose if not moving else self._leashed(advance(memory.pose, velocity, dt), state)
        ground = self._ground(memory.ground, state, dt)
        schedule = ContactSchedule.standing()
        if np.isfinite(start):
            schedule = self._gait.schedule(start, stop, until=now + c.horizon + self._gait.duration)
            if now > schedule.event_times[-1] and np.isfinite(stop):
                start, stop, schedule = np.inf, np.inf, ContactSchedule.standing()
        if not np.isfinite(start):
            velocity = np.zeros(3)
        reference = self._reference(now, pose, velocity, ground, schedule, state)
        return WalkMemory(now, pose, velocity, ground, start, stop, reference)

    def _feasible(self, command: np.ndarray) -> np.ndarray:
        """The command, scaled down to what the legs can reach: during a stance the base moves two strides."""
        arms = self._footholds_B[:, 1::-1] * [-1.0, 1.0]
        speeds = np.sqrt(((command[:2] + command[2] * arms) ** 2).sum(axis=1))
        return command * min(1.0, self._max_speed / max(speeds.max(), 1e-9))

    def _phase(self, memory: WalkMemory, command, now: float) -> tuple[float, float]:
        """Start and stop of the gait."""
        wanted = np.any(np.abs(command) > STILL)
        start, stop = memory.gait_start, memory.gait_stop
        if wanted and not np.isfinite(start):
            return now + self._config.start_delay, np.inf
        if wanted:
            return start, np.inf
        still = np.all(np.abs(memory.velocity) <= STILL)
        if np.isfinite(start) and still and not np.isfinite(stop):
            return start, now
        return start, stop

    def _leashed(self, pose: np.ndarray, state: RobotState) -> np.ndarray:
        """Keeps the reference close to the robot: an obstacle or a push does not wind it up."""
        offset = pose[:2] - state.p_WB[:2]
        distance = np.sqrt(offset @ offset)
        if distance > self._config.leash:
            offset = offset * self._config.leash / distance
        turn = np.clip(wrapped(pose[2] - state.rpy_WB[2]), -self._config.yaw_leash, self._config.yaw_leash)
        return np.array([*(state.p_WB[:2] + offset), state.rpy_WB[2] + turn])

    def _feet(self, state: RobotState) -> np.ndarray:
        """Foot centres in W, (4, 3)."""
        return state.p_WB + self._robot.foot_positions_B(state.joint_positions) @ state.R_WB.T

    def _stance_centre(self, state: RobotState) -> np.ndarray:
        """Where the base belongs above the present feet, xy [m]."""
        nominal = self._footholds_B[:, :2].mean(axis=0)
        return self._feet(state)[:, :2].mean(axis=0) - yaw_matrix(state.rpy_WB[2])[:2, :2] @ nominal

    def _ground(self, ground: float, state: RobotState, dt: float) -> float:
        """Low-passed height of the ground under the feet that touch it [m]."""
        if not np.any(state.contacts):
            return ground
        seen = self._feet(state)[state.contacts, 2].mean() - self._robot.foot_radius
        return ground + (1.0 - np.exp(-dt / self._config.ground_filter_time)) * (seen - ground)

    def _reference(self, now, pose, velocity, ground, schedule: ContactSchedule, state) -> WholeBodyReference:
        c = self._config
        times = now + np.arange(0.0, c.horizon + c.sample_time, c.sample_time)
        states = np.zeros((len(times), 24))
        poses = advance(pose, velocity, times - now)
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        states[:, 0] = cos * velocity[0] - sin * velocity[1]
        states[:, 1] = sin * velocity[0] + cos * velocity[1]
        states[:, 6:8] = poses[:, :2]
        states[:, 8] = ground + self._robot.nominal_base_height
        states[:, 11] = poses[:, 2]
        down = schedule.stance[np.searchsorted(schedule.event_times, times, side="right")]
        inputs = weight_bearing_inputs(down, self._robot.mass)
        states[:, 12 : 12 + NUM_JOINTS] = self._robot.nominal_joints
        return WholeBodyReference(
            now, 1, times, states, inputs, schedule, self._footholds(now, pose, velocity, ground, schedule, state)
        )

    def _footholds(self, now, pose, velocity, ground, schedule: ContactSchedule, state) -> tuple:
        """FootholdTargets of all swings that touch down within the horizon."""
        c = self._config
        drift = state.v_WB[:2] - yaw_matrix(pose[2])[:2, :2] @ velocity[:2]
        correction = c.velocity_feedback * np.sqrt(self._height / GRAVITY) * drift
        correction = correction * min(1.0, c.max_correction / max(np.sqrt(correction @ correction), 1e-9))
        targets = []
        for leg in Leg:
            swings = schedule.swings(leg)
            for i, (liftoff, touchdown) in enumerate(swings):
                if touchdown < now - 0.5 or liftoff > now + c.horizon:
                    continue
                stance = swings[i + 1][0] - touchdown if i + 1 < len(swings) else 0.0
                x, y, yaw = advance(pose, velocity, touchdown + 0.5 * stance - now)
                position = np.array([x, y, 0.0]) + yaw_matrix(yaw) @ self._footholds_B[leg]
                position[:2] += correction
                position[2] = ground + self._robot.foot_radius
                targets.append(FootholdTarget(leg, liftoff, touchdown, position, np.array([0.0, 0.0, 1.0])))
        return tuple(sorted(targets, key=lambda target: target.touchdown_time))


def longest_stance(gait: Gait) -> float:
    """Longest time that a foot stays down in the gait [s]; the cycle for a gait without swings."""
    schedule = gait.schedule(0.0, 3.0 * gait.duration)
    stances = []
    for leg in Leg:
        swings = schedule.swings(leg)
        stances += [after[0] - before[1] for before, after in pairwise(swings)]
    return max(stances, default=gait.duration)


def advance(pose: np.ndarray, velocity: np.ndarray, dt) -> np.ndarray:
    """Pose (x, y, yaw) after ``dt`` [s], (3,), or (n, 3) for n times, at constant velocity in its heading frame."""
    forward, left, rate = velocity
    half = 0.5 * rate * np.asarray(dt, dtype=float)
    cos, sin = np.cos(pose[2] + half), np.sin(pose[2] + half)
    chord = dt * np.sinc(half / np.pi)
    x, y = pose[0] + chord * (cos * forward - sin * left), pose[1] + chord * (sin * forward + cos * left)
    return np.stack((x, y, pose[2] + 2.0 * half), axis=-1)


def yaw_matrix(yaw: float) -> np.ndarray:
    """Rotation about z, (3, 3)."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def wrapped(angle: float) -> float:
    """The angle in (-pi, pi] [rad]."""
    return -((np.pi - angle) % (2.0 * np.pi) - np.pi)
