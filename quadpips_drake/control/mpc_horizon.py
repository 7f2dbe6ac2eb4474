"""What the MPC looks at: its time grid, the reference on it, and where each foot is to be."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.robots.legs import NUM_LEGS, Leg
from quadpips_drake.robots.robot_state import RobotState
from quadpips_drake.trajectory.reference import ContactSchedule, FootholdTarget, WholeBodyReference
from quadpips_drake.values import ImmutableValue

GRAVITY = 9.81
_EARLY_PHASE = 0.6
"""From this part of a swing on a touch counts as touch-down [1]."""
_MATCH = 0.05
"""A foothold belongs to a swing when their touch-downs are closer than this [s]."""


def graded_grid(first_step: float, horizon: float, intervals: int) -> np.ndarray:
    """Knots from 0 to ``horizon`` [s], (intervals + 1,); steps grow geometrically from ``first_step``.

    Near steps decide what is done until the next solve; far ones only show where it leads.
    """
    if first_step * intervals >= horizon:
        return np.linspace(0.0, horizon, intervals + 1)
    low, high = 1.0, 3.0
    for _ in range(60):
        ratio = 0.5 * (low + high)
        total = first_step * np.sum(ratio ** np.arange(intervals))
        low, high = (ratio, high) if total < horizon else (low, ratio)
    steps = first_step * low ** np.arange(intervals)
    return np.concatenate(([0.0], np.cumsum(steps) * horizon / steps.sum()))


@dataclass(frozen=True, eq=False)
class StandingPose(ImmutableValue):
    """A stance to be kept while there is no reference; latched once, so that it does not drift with the robot."""

    p_WB: np.ndarray
    """Base position [m], (3,)."""
    rpy_WB: np.ndarray
    """[rad], (3,)."""


def standing_pose(state: RobotState, robot) -> StandingPose:
    """The nominal base pose above the present feet: centred, at nominal height, inclined half as much as their plane."""
    feet = state.p_WB + robot.foot_positions_B(state.joint_positions) @ state.R_WB.T
    yaw = float(state.rpy_WB[2])
    c, s = np.cos(yaw), np.sin(yaw)
    heading = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    feet_H = feet @ heading  # seen in the heading frame, where nominal footholds are comparable
    nominal = robot.nominal_footholds_B
    fore, hind = feet_H[[Leg.LF, Leg.RF]].mean(axis=0), feet_H[[Leg.LH, Leg.RH]].mean(axis=0)
    left, right = feet_H[[Leg.LF, Leg.LH]].mean(axis=0), feet_H[[Leg.RF, Leg.RH]].mean(axis=0)
    pitch = -0.5 * np.arctan2(fore[2] - hind[2], fore[0] - hind[0])
    roll = 0.5 * np.arctan2(left[2] - right[2], left[1] - right[1])
    p_WB = heading @ (feet_H.mean(axis=0) - nominal.mean(axis=0))
    return StandingPose(p_WB, np.array([roll, pitch, yaw]))


def standing_samples(pose: StandingPose, robot, intervals: int) -> tuple[np.ndarray, np.ndarray]:
    """Reference states (N + 1, 24) and inputs (N, 24) of keeping ``pose``."""
    state = np.zeros(24)
    state[6:9], state[9:12], state[12:] = pose.p_WB, pose.rpy_WB, robot.nominal_joints
    return np.tile(state, (intervals + 1, 1)), weight_bearing_inputs(np.ones((intervals, NUM_LEGS), dtype=bool), robot.mass)


def weight_bearing_inputs(stance: np.ndarray, mass: float) -> np.ndarray:
    """Inputs (N, 24) in which the stance feet, bool (N, 4), share the weight and no joint moves."""
    inputs = np.zeros((len(stance), 24))
    inputs[:, 2 : 3 * NUM_LEGS : 3] = stance * (mass * GRAVITY / np.maximum(stance.sum(axis=1), 1))[:, None]
    return inputs


def sampled_states(reference: WholeBodyReference, times: np.ndarray, yaw: float) -> np.ndarray:
    """Reference states at ``times`` (n, 24), linear in between, at rest outside; yaw continued from the present ``yaw``."""
    states = np.stack([np.interp(times, reference.times, column) for column in reference.states.T], axis=1)
    outside = (times < reference.times[0]) | (times > reference.end_time)
    states[outside, :6] = 0.0
    states[:, 11] += 2.0 * np.pi * np.round((yaw - states[0, 11]) / (2.0 * np.pi))
    return states


def interval_stance(schedule: ContactSchedule, times: np.ndarray) -> np.ndarray:
    """Stance flags of each interval of ``times``, taken at its middle, bool (N, 4)."""
    middle = 0.5 * (times[:-1] + times[1:])
    return schedule.stance[np.searchsorted(schedule.event_times, middle, side="right")]


def with_early_contacts(stance: np.ndarray, times: np.ndarray, contacts: np.ndarray, swings: tuple) -> np.ndarray:
    """The planned stance flags (N, 4), where a foot that touched the ground late in its swing bears load from now on.

    The opposite, a foot that is late, stays planned as in stance on purpose: a plan without its force lets the robot sink at
    the very moment when the foot finds the ground.

    Args:
        contacts: feet that touch the ground, bool (4,).
        swings: splines of each leg that end after ``times[0]``.
    """
    now = times[0]
    middle = 0.5 * (times[:-1] + times[1:])
    corrected = stance.copy()
    for leg in np.flatnonzero(contacts):
        for spline in swings[leg]:
            early = spline.start_time + _EARLY_PHASE * (spline.end_time - spline.start_time)
            if early < now < spline.end_time:
                corrected[middle < spline.end_time, leg] = True
    return corrected


def matching_target(footholds: tuple, leg: Leg, touchdown: float) -> FootholdTarget | None:
    """The target of ``leg`` that belongs to the swing ending at ``touchdown`` [s]."""
    best = None
    for target in footholds:
        if target.leg == leg and abs(target.touchdown_time - touchdown) < _MATCH:
            best = target
    return best


def plan_swings(
    schedule: ContactSchedule, footholds: tuple, feet: np.ndarray, now: float, until: float, make_swing
) -> tuple:
    """For each leg the splines of its swings between ``now`` and ``until`` [s], and the last one before.

    Args:
        schedule: contacts in absolute time.
        footholds: FootholdTargets; a swing without one comes down where it began.
        feet: where each foot stands, or stood when its present swing began, in W, (4, 3).
        make_swing: function (liftoff time, touchdown time, start point, end point, end normal) -> spline.
    """
    plans = []
    for leg in Leg:
        splines = []
        point = np.asarray(feet[leg])
        for liftoff, touchdown in schedule.swings(leg):
            if touchdown <= now or liftoff >= until or not np.isfinite(touchdown - liftoff):
                continue
            target = matching_target(footholds, leg, touchdown)
            end = point if target is None else target.position
            normal = np.array([0.0, 0.0, 1.0]) if target is None else target.normal
            splines.append(make_swing(liftoff, touchdown, point, end, normal))
            point = end
        plans.append(tuple(splines))
    return tuple(plans)


def foot_references(swings: tuple, feet: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities of the feet at ``times``, each (n, 4, 3): on the ground, along the splines, on the ground."""
    p = np.tile(feet, (len(times), 1, 1))
    v = np.zeros_like(p)
    for leg, splines in enumerate(swings):
        for spline in splines:
            landed = times >= spline.end_time
            p[landed, leg] = spline.evaluate(spline.end_time)[0]
            for k in np.flatnonzero((times >= spline.start_time) & ~landed):
                p[k, leg], v[k, leg], _ = spline.evaluate(times[k])
    return p, v


def ground_normals(footholds: tuple, times: np.ndarray) -> np.ndarray:
    """Unit normal of the ground under each foot in each interval of ``times``, or where it comes down next, (N, 4, 3).

    A normal belongs to a foothold from its lift-off on; without a foothold the ground is taken as level.
    """
    normals = np.tile([0.0, 0.0, 1.0], (len(times) - 1, NUM_LEGS, 1))
    middle = 0.5 * (times[:-1] + times[1:])
    for target in footholds:  # in order of touch-down: later ones overwrite
        normals[middle >= target.liftoff_time, target.leg] = target.normal
    return normals
