"""Signs that a robot falls or is about to, and the memory that makes events out of them.

QuadPiPS section VII-A aborts the reference on large roll, pitch, joint velocities and torques, and stabilises before it
plans again; it gives no numbers, and in the release this is an empty function. The numbers here are ours.
"""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS, Leg
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import SAFETY_EVENTS, SafetyStatus


@configuration
class SafetyConfig(StageConfig):
    """Bounds of what is still normal: beyond them a reference is aborted."""

    rate: float = stage_rate(100.0)
    """How often it looks at the robot [Hz]."""

    max_tilt: float = ranged(0.5, 0.01, 3.2)
    """|roll| and |pitch| above which the robot counts as unstable [rad]: stances are planned with up to 0.35. (15 degrees in
    the release's unused checker, which a ramp exceeds by itself.)"""
    fall_tilt: float = ranged(0.8, 0.01, 3.2)
    """|roll| and |pitch| above which it has fallen [rad]."""
    min_height_ratio: float = ranged(0.5, 0.0, 1.0)
    """Height of the base above its feet, as part of the nominal one, below which it has fallen [1]."""
    max_turn_rate: float = ranged(5.0, 0.01, 1000.0)
    """Angular speed of the torso above which it counts as unstable, if sustained [rad/s] (the release's: 5)."""
    max_joint_speed_ratio: float = ranged(1.2, 0.01, 1000.0)
    """Joint speed as part of its limit above which the robot counts as unstable, if sustained [1]."""
    max_torque_ratio: float = ranged(0.98, 0.01, 1000.0)
    """Joint torque as part of its limit that counts as saturated [1]."""
    max_saturated_joints: int = ranged(3, 0, 12)
    """As many saturated joints at once are still normal [1]; more, sustained, are not."""
    sustained: float = ranged(0.2, 0.0, 1000.0)
    """How long too fast joints, a too fast turn or saturated torques are tolerated [s]: a swing may do that for a moment."""
    max_slip: float = ranged(0.08, 0.001, 1000.0)
    """How far a foot may slide from where it came down [m]."""
    max_mismatch_time: float = ranged(0.3, 0.0, 1000.0)
    """How long a foot may lack the ground while it is planned to stand [s]; late touch-downs take a while."""
    calm_joint_speed: float = ranged(0.5, 0.001, 100.0)
    """A robot at rest moves no joint faster than this [rad/s]."""
    calm_base_speed: float = ranged(0.10, 0.0, 100.0)
    """... and its base no faster than this [m/s]."""
    stabilise_time: float = ranged(0.5, 0.0, 1000.0)
    """An event is over when the robot has been upright and at rest for so long [s]."""

    def __post_init__(self):
        super().__post_init__()
        if self.max_tilt > self.fall_tilt:
            raise UserInputError(f"max_tilt must be at most fall_tilt, {self.fall_tilt:g} rad, not {self.max_tilt:g} rad")


def tilt(state: RobotState) -> float:
    """Larger of |roll| and |pitch| [rad]."""
    return float(np.abs(state.rpy_WB[:2]).max())


def height_above_feet(state: RobotState, robot) -> float:
    """Height of the base origin above the mean of the foot centres in W [m]."""
    p_BF_W = robot.foot_positions_at(np.zeros(3), state.R_WB, state.joint_positions)
    return -float(np.mean(p_BF_W[:, 2]))


def fall_reason(state: RobotState, robot, config: SafetyConfig) -> str:
    """Why the robot counts as fallen; empty while it stands."""
    if tilt(state) > config.fall_tilt:
        return f"tilt {tilt(state):.2f} rad exceeds {config.fall_tilt} rad"
    height = height_above_feet(state, robot)
    if height < config.min_height_ratio * robot.nominal_base_height:
        return f"base only {height:.2f} m above its feet"
    return ""


def attitude_reason(state: RobotState, config: SafetyConfig) -> str:
    """Says how far the base tilts if that is too far, else nothing."""
    return f"the base tilts by {tilt(state):.2f} rad" if tilt(state) > config.max_tilt else ""


def turn_reason(state: RobotState, config: SafetyConfig) -> str:
    """Says how fast the base turns if that is too fast."""
    rate = float(np.sqrt(state.w_WB @ state.w_WB))
    return f"the base turns at {rate:.1f} rad/s" if rate > config.max_turn_rate else ""


def joint_speed_reason(state: RobotState, robot, config: SafetyConfig) -> str:
    """Names the fastest joint if it is too fast."""
    speed = np.abs(state.joint_velocities) / robot.velocity_limits
    if speed.max() <= config.max_joint_speed_ratio:
        return ""
    return f"joint {robot.joint_names[int(speed.argmax())]} turns at {speed.max():.0%} of its speed limit"


def torque_reason(state: RobotState, robot, config: SafetyConfig) -> str:
    """Says how many joints are saturated if these are too many."""
    saturated = np.count_nonzero(np.abs(state.joint_torques) > config.max_torque_ratio * robot.effort_limits)
    return f"{saturated} joints are at their torque limit" if saturated > config.max_saturated_joints else ""


def is_calm(state: RobotState, config: SafetyConfig) -> bool:
    """Whether the robot is upright and at rest."""
    slow = np.abs(state.joint_velocities).max() < config.calm_joint_speed
    return bool(slow and np.linalg.norm(state.v_WB) < config.calm_base_speed and not attitude_reason(state, config))


@dataclass(frozen=True, eq=False)
class SafetyMemory(ImmutableValue):
    """What the monitor remembers from one look to the next."""

    status: SafetyStatus
    onset: np.ndarray
    """Since when the sign of each event has been there [s], inf while it is not, (5,)."""
    anchors: np.ndarray
    """Where each planned stance foot came down in W [m], (4, 3); NaN for feet in the air."""
    missing_since: np.ndarray
    """Since when each foot has lacked the ground that it was planned to stand on [s], inf while it does not, (4,)."""
    hanging: np.ndarray
    """Feet without ground below them on which the robot has come to rest all the same, bool (4,): no news any more, until
    they find ground or are to swing."""
    calm_since: float = np.inf
    """[s]"""
    released: float = -np.inf
    """References published before this time are stale: an event came between [s]."""

    @staticmethod
    def empty() -> "SafetyMemory":
        never, nowhere = np.full(len(SAFETY_EVENTS), np.inf), np.full((NUM_LEGS, 3), np.nan)
        hanging = np.zeros(NUM_LEGS, dtype=bool)
        return SafetyMemory(SafetyStatus(-np.inf), never, nowhere, np.full(NUM_LEGS, np.inf), hanging)


def watch(memory: SafetyMemory, state: RobotState, policy: MpcPolicy, robot, config: SafetyConfig) -> SafetyMemory:
    """The memory after a look at ``state``: signs that last become events, an event lasts until the robot is at rest.

    Args:
        memory: so far.
        state: measured state.
        policy: MPC policy with the planned contacts; an empty one plans all feet down.
        robot: RobotModel.
        config: bounds.
    """
    now = state.stamp
    memory = _with_contacts(memory, state, policy.schedule.at(now), robot)
    reasons = _signs(memory, state, robot, config)
    onset = np.where([bool(reason) for reason in reasons], np.minimum(memory.onset, now), np.inf)
    calm = is_calm(state, config)
    calm_since = min(memory.calm_since, now) if calm else np.inf
    memory = replace(memory, onset=onset, calm_since=calm_since, status=replace(memory.status, stamp=now, at_rest=calm))
    if memory.status.unstable:
        if now - calm_since < config.stabilise_time:
            return memory
        # Feet are where they are now: what has slipped or found no ground before is no new event.
        anchors = np.full((NUM_LEGS, 3), np.nan)
        hanging = memory.hanging | np.isfinite(memory.missing_since)
        status = replace(memory.status, unstable=False)
        return replace(memory, status=status, anchors=anchors, hanging=hanging, released=now)
    patience = np.array([0.0, config.sustained, config.sustained, 0.0, 0.0])
    lasting = np.flatnonzero(now - onset >= patience - 1e-9)
    if len(lasting) == 0:
        return memory
    first = int(lasting[0])
    counts = tuple(count + (i == first) for i, count in enumerate(memory.status.counts))
    status = SafetyStatus(now, True, SAFETY_EVENTS[first], reasons[first], counts, calm)
    return replace(memory, status=status, calm_since=np.inf, released=np.inf)


def _signs(memory: SafetyMemory, state: RobotState, robot, config: SafetyConfig) -> list[str]:
    """What speaks for each event at this moment, in the order of SAFETY_EVENTS; empty strings for nothing."""
    return [
        attitude_reason(state, config),
        joint_speed_reason(state, robot, config) or turn_reason(state, config),
        torque_reason(state, robot, config),
        _slip_reason(memory, state, robot, config),
        _contact_reason(memory, state.stamp, config),
    ]


def _with_contacts(memory: SafetyMemory, state: RobotState, planned: np.ndarray, robot) -> SafetyMemory:
    down = planned & state.contacts
    fresh = down & np.isnan(memory.anchors[:, 0])
    anchors = memory.anchors
    if fresh.any() or not planned.all():
        anchors = np.where(planned[:, None], anchors, np.nan)
        anchors = np.where(fresh[:, None], robot.foot_positions_W(state), anchors)
    missing = planned & ~state.contacts
    hanging = memory.hanging & missing
    since = np.where(missing & ~hanging, np.minimum(memory.missing_since, state.stamp), np.inf)
    return replace(memory, anchors=anchors, missing_since=since, hanging=hanging)


def _slip_reason(memory: SafetyMemory, state: RobotState, robot, config: SafetyConfig) -> str:
    moved = np.linalg.norm(robot.foot_positions_W(state) - memory.anchors, axis=1)
    moved = np.where(state.contacts & ~np.isnan(moved), moved, 0.0)
    if moved.max() <= config.max_slip:
        return ""
    return f"foot {Leg(int(moved.argmax())).name} has slipped by {moved.max():.2f} m"


def _contact_reason(memory: SafetyMemory, now: float, config: SafetyConfig) -> str:
    waiting = now - memory.missing_since
    if waiting.max() <= config.max_mismatch_time:
        return ""
    return f"foot {Leg(int(waiting.argmax())).name} has found no ground for {waiting.max():.2f} s"
