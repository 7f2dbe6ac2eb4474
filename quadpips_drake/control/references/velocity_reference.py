"""A whole-body reference out of a velocity command and a gait: walking on unseen ground without a planner."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.control.mpc.mpc_horizon import weight_bearing_inputs
from quadpips_drake.control.references.ground_plane import GroundPlane, fitted_plane
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.gaits.gait_timeline import GaitTimeline, standing_timeline
from quadpips_drake.gaits.gaits import Gait, load_gait
from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.values.centroidal import STATE_SIZE, CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.robot_state import RobotState

STILL = 1e-3
"""Speeds below this [m/s, rad/s] count as standing."""
_SAME_TIME = 1e-4
"""Touch-downs closer than this are the same [s]."""
STANCE = "stance"
"""Name of the gait without swings."""


@configuration
class VelocityReferenceConfig(StageConfig):
    """How a velocity command becomes a reference."""

    rate: float = stage_rate(50.0)
    """How often it makes a new reference [Hz]."""

    horizon: float = ranged(1.8, 0.1, 10.0)
    """Length of the reference [s]; longer than the MPC's horizon plus a swing."""
    sample_time: float = ranged(0.05, 0.01, 1.0)
    """Distance of its samples [s]."""
    start_delay: float = ranged(0.3, 0.0, 60.0)
    """From the command to walk to the first lift-off [s]."""
    change_lead: float = ranged(0.04, 0.0, 10.0)
    """When the gait is to change, feet are lifted as planned for so long [s]."""
    change_pause: float = ranged(0.05, 0.0, 10.0)
    """How long all feet stay down between two gaits [s]."""
    max_acceleration: float = ranged(0.5, 0.001, 100.0)
    """How fast the commanded velocity is taken up [m/s^2]."""
    max_yaw_acceleration: float = ranged(1.0, 0.001, 100.0)
    """How fast the commanded yaw rate is taken up [rad/s^2]."""
    leash: float = ranged(0.10, 0.0, 10.0)
    """Largest distance of the reference from the robot [m]."""
    yaw_leash: float = ranged(0.2, 0.0, 3.0)
    """Largest yaw of the reference from the robot's [rad]."""
    velocity_feedback: float = ranged(1.0, 0.0, 10.0)
    """Raibert's correction of footholds, as part of sqrt(height / gravity) [1]."""
    foothold_anchor: float = ranged(1.0, 0.0, 1.0)
    """Below what feet are placed: 1 the measured base, 0 its reference, and anything in between [1]."""
    max_correction: float = ranged(0.15, 0.0, 1.0)
    """Largest correction of a foothold [m]."""
    settled_phase: float = ranged(0.8, 0.0, 1.0)
    """Part of a swing after which its foothold is not moved any more, 0..1 [1]: the foot could no longer follow. 1: it moves
    until touch-down."""
    max_stride_ratio: float = ranged(0.45, 0.01, 2.0)
    """How far a foot may move ahead of its hip and behind it, as part of the hip's height [1]; commands that need more in
    the given gait are scaled down."""
    ground_filter_time: float = ranged(0.2, 0.001, 100.0)
    """Time constant of the estimated height of the ground [s]."""
    slope_filter_time: float = ranged(0.3, 0.001, 100.0, zero=True)
    """Time constant of its estimated slope [s]; 0: the ground is taken as level."""
    slope_following: float = ranged(1.0, 0.0, 1.0)
    """Inclination of the base as part of the ground's, 0..1 [1]."""


@dataclass(frozen=True, eq=False)
class WalkMemory(ImmutableValue):
    """What a walk by velocity command remembers from one update to the next."""

    stamp: float
    """[s]"""
    pose: np.ndarray
    """Reference x, y [m], yaw [rad], (3,)."""
    velocity: np.ndarray
    """Velocity taken up so far: forward, left [m/s], yaw rate [rad/s], (3,)."""
    timeline: GaitTimeline
    """Gaits so far and to come."""
    touched: np.ndarray | None = None
    """Where each foot touched the ground last, in W [m], (4, 3)."""
    ground: GroundPlane | None = None
    """The plane through these points."""
    still_since: float = np.inf
    """Since when the velocity taken up has been zero [s]; infinite while it is not."""
    reference: WholeBodyReference = None
    """Result of the update."""

    @staticmethod
    def empty() -> "WalkMemory":
        return WalkMemory(
            -np.inf, np.zeros(3), np.zeros(3), standing_timeline(load_gait(STANCE)), reference=WholeBodyReference.empty()
        )


class VelocityWalk:
    """Rolling reference: the base moves with the command, feet come down where Raibert's rule wants them.

    A foot is placed where its nominal foothold will lie in the middle of the coming stance, below a base that goes on as
    commanded from where it is, plus k sqrt(h / g) (v - v_ref) (M. Raibert, Legged Robots That Balance, 1986; k = 1 is the
    capture point of the linear inverted pendulum), on the plane through the points where the feet touched the ground last.
    The base follows the inclination of that plane.
    """

    def __init__(self, robot, config: VelocityReferenceConfig | None = None):
        self._robot = robot
        self._config = config or VelocityReferenceConfig()
        self._footholds_B = robot.nominal_footholds_B
        self._height = -float(self._footholds_B[:, 2].mean())

    def update(self, memory: WalkMemory, state: RobotState, command: np.ndarray, gait: Gait) -> WalkMemory:
        """Next memory, with the reference from ``state.stamp`` on.

        Args:
            memory: result of the last update.
            state: measured state.
            command: forward, left [m/s], yaw rate [rad/s] in the robot's heading frame, (3,).
            gait: in which to walk; a gait without swings: to stop, and stand.
        """
        c = self._config
        now = state.stamp
        if memory.touched is None:
            memory = self._first(state, memory)
        dt = now - memory.stamp
        timeline = self._timeline(memory, gait, now)
        walking = timeline.gait.name != STANCE and timeline.is_under_way(now)
        command = self.feasible(command, timeline.gait) if walking and gait.name != STANCE else np.zeros(3)
        step = dt * np.array([c.max_acceleration, c.max_acceleration, c.max_yaw_acceleration])
        velocity = memory.velocity + np.clip(command - memory.velocity, -step, step)
        still = bool(np.all(np.abs(velocity) <= STILL))
        pose = memory.pose if still else advance(memory.pose, velocity, dt)
        pose = self._leashed(pose, state) if walking else pose
        schedule = timeline.schedule(now, now + c.horizon + timeline.gait.duration)
        touched, ground = self._ground(memory, state, schedule.at(now), dt)
        settled = self._settled(memory.reference, now)
        reference = self._reference(now, pose, velocity, ground, schedule, state, settled)
        still_since = min(memory.still_since, now) if still else np.inf
        return WalkMemory(now, pose, velocity, timeline, touched, ground, still_since, reference)

    def _first(self, state: RobotState, memory: WalkMemory) -> WalkMemory:
        """The memory of a robot that stands: its reference is above its feet."""
        feet = self._robot.foot_positions_W(state)
        nominal = self._footholds_B[:, :2].mean(axis=0)
        centre = feet[:, :2].mean(axis=0) - yaw_matrix(state.rpy_WB[2])[:2, :2] @ nominal
        touched = self._robot.soles_W(feet)
        ground = fitted_plane(touched, centre)
        pose = np.array([*centre, state.rpy_WB[2]])
        return WalkMemory(state.stamp, pose, np.zeros(3), memory.timeline, touched, ground, state.stamp, memory.reference)

    def _timeline(self, memory: WalkMemory, gait: Gait, now: float) -> GaitTimeline:
        """The timeline with the wanted gait; before a stop the robot steps on the spot for a cycle, to order its feet."""
        c = self._config
        timeline = memory.timeline
        if gait.name == timeline.gait.name:
            return timeline
        if gait.name == STANCE and now < memory.still_since + timeline.gait.duration:
            return timeline
        pause = c.start_delay - c.change_lead if timeline.gait.name == STANCE else c.change_pause
        return timeline.changed_to(gait, now, lead=c.change_lead, pause=max(pause, 0.0))

    def feasible(self, command: np.ndarray, gait: Gait) -> np.ndarray:
        """The command, scaled down to what the legs can reach: during a stance the base moves two strides.

        Args: forward, left [m/s], yaw rate [rad/s], (3,); the gait, nothing is feasible in one without swings.
        """
        if gait.name == STANCE:
            return np.zeros(3)
        max_speed = 2.0 * self._config.max_stride_ratio * self._height / longest_stance(gait)
        arms = self._footholds_B[:, 1::-1] * [-1.0, 1.0]
        speeds = np.sqrt(((command[:2] + command[2] * arms) ** 2).sum(axis=1))
        return command * min(1.0, max_speed / max(speeds.max(), 1e-9))

    def _leashed(self, pose: np.ndarray, state: RobotState) -> np.ndarray:
        """Keeps the reference close to the robot: an obstacle or a push does not wind it up."""
        offset = pose[:2] - state.p_WB[:2]
        distance = np.sqrt(offset @ offset)
        if distance > self._config.leash:
            offset = offset * self._config.leash / distance
        turn = np.clip(wrap_angle(pose[2] - state.rpy_WB[2]), -self._config.yaw_leash, self._config.yaw_leash)
        return np.array([*(state.p_WB[:2] + offset), state.rpy_WB[2] + turn])

    def _ground(self, memory: WalkMemory, state: RobotState, planned: np.ndarray, dt: float):
        """Where the feet touched the ground last (4, 3), and the plane through these points, low-passed.

        ``planned``: which feet are to be down now, bool (4,).
        """
        c = self._config
        down = state.contacts & planned
        radius = self._robot.foot_radius
        feet = self._robot.foot_positions_W(state)
        touched = np.where(down[:, None], feet - radius * memory.ground.normal, memory.touched)
        gains = [1.0 - np.exp(-dt / time) if time > 0.0 else 0.0 for time in (c.ground_filter_time, c.slope_filter_time)]
        return touched, memory.ground.improved(touched, state.p_WB[:2], *gains)

    def _settled(self, reference: WholeBodyReference, now: float) -> dict:
        """Footholds of the last reference whose swings are nearly over, by leg."""
        phase = self._config.settled_phase
        return {
            target.leg: target
            for target in reference.footholds
            if target.liftoff_time + phase * (target.touchdown_time - target.liftoff_time) < now < target.touchdown_time
        }

    def _reference(self, now, pose, velocity, ground, schedule: ContactSchedule, state, settled) -> WholeBodyReference:
        c = self._config
        times = now + np.arange(0.0, c.horizon + c.sample_time, c.sample_time)
        states = np.zeros((len(times), STATE_SIZE))
        poses = advance(pose, velocity, times - now)
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        linear, position = states[:, CentroidalState.LINEAR], states[:, CentroidalState.POSITION]
        linear[:, 0] = cos * velocity[0] - sin * velocity[1]
        linear[:, 1] = sin * velocity[0] + cos * velocity[1]
        linear[:, 2] = linear[:, :2] @ ground.slope
        position[:, :2] = poses[:, :2]
        position[:, 2] = ground.at(poses[:, :2]) + self._robot.nominal_base_height
        orientation = states[:, CentroidalState.ORIENTATION]
        orientation[:, :2] = c.slope_following * ground.inclination(poses[:, 2])
        orientation[:, 2] = poses[:, 2]
        down = schedule.stance[np.searchsorted(schedule.event_times, times, side="right")]
        inputs = weight_bearing_inputs(down, self._robot.mass)
        states[:, CentroidalState.JOINTS] = self._robot.nominal_joints
        footholds = self._footholds(now, pose, velocity, ground, schedule, state, settled)
        return WholeBodyReference(now, 1, times, states, inputs, schedule, footholds, rolling=True)

    def _footholds(self, now, pose, velocity, ground, schedule: ContactSchedule, state, settled: dict) -> tuple:
        """FootholdTargets of all swings that touch down within the horizon; those in ``settled``, by leg, stay."""
        c = self._config
        drift = state.v_WB[:2] - yaw_matrix(pose[2])[:2, :2] @ velocity[:2]
        correction = c.velocity_feedback * np.sqrt(self._height / GRAVITY) * drift
        correction = correction * min(1.0, c.max_correction / max(np.sqrt(correction @ correction), 1e-9))
        anchor = pose.copy()
        anchor[:2] += c.foothold_anchor * (state.p_WB[:2] - pose[:2])
        targets, free = [], []
        for leg in Leg:
            swings = schedule.swings(leg)
            for i, (liftoff, touchdown) in enumerate(swings):
                if touchdown < now - 0.5 or liftoff > now + c.horizon:
                    continue
                if leg in settled and abs(settled[leg].touchdown_time - touchdown) < _SAME_TIME:
                    targets.append(settled[leg])
                    continue
                stance = swings[i + 1][0] - touchdown if i + 1 < len(swings) else 0.0
                free.append((leg, liftoff, touchdown, touchdown + 0.5 * stance - now))
        if free:
            poses = advance(anchor, velocity, np.array([ahead for *_, ahead in free]))
            positions = self._below(poses, [leg for leg, *_ in free], correction, ground)
            for (leg, liftoff, touchdown, _), position in zip(free, positions, strict=True):
                targets.append(FootholdTarget(leg, liftoff, touchdown, position, ground.normal))
        return tuple(sorted(targets, key=lambda target: target.touchdown_time))

    def _below(self, poses: np.ndarray, legs: list, correction: np.ndarray, ground: GroundPlane) -> np.ndarray:
        """Foot centres (n, 3) on the ground below bases at ``poses`` (x, y, yaw) (n, 3), moved by ``correction`` (2,)."""
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        nominal = self._footholds_B[legs]
        positions = np.empty((len(poses), 3))
        positions[:, 0] = poses[:, 0] + cos * nominal[:, 0] - sin * nominal[:, 1] + correction[0]
        positions[:, 1] = poses[:, 1] + sin * nominal[:, 0] + cos * nominal[:, 1] + correction[1]
        positions[:, 2] = ground.at(positions[:, :2])
        return positions + self._robot.foot_radius * ground.normal


@cache
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
