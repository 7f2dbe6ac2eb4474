"""What the MPC looks at: the reference and the contacts on its time grid."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from quadpips_drake.control.early_contact import counts_as_touchdown
from quadpips_drake.math.angles import whole_turns
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.interpolation import interpolated
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.values.centroidal import INPUT_SIZE, CentroidalInput, CentroidalState, centroidal_state
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS, Leg
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.robot_state import RobotState

_NO_FORCE = 1e-3
"""A foot with less force than this in the last solution was planned to be in the air [N]."""
_JOINT_RATES = CentroidalInput.JOINT_VELOCITIES.start


@dataclass(frozen=True, eq=False)
class StandingPose(ImmutableValue):
    """A stance to be kept while there is no reference; latched once, so that it does not drift with the robot."""

    p_WB: np.ndarray
    """Base position [m], (3,)."""
    rpy_WB: np.ndarray
    """[rad], (3,)."""


def standing_pose(state: RobotState, robot) -> StandingPose:
    """The nominal base pose above the present feet: centred, at nominal height, inclined half as much as their plane.

    Feet in the air are taken for where they will find the ground: as low as those that touch it, or as the lowest one.
    """
    feet = robot.foot_positions_W(state)
    ground = feet[state.contacts, 2].mean() if state.contacts.any() else feet[:, 2].min()
    feet[~state.contacts, 2] = ground
    yaw = float(state.rpy_WB[2])
    heading = yaw_matrix(yaw)
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
    state = centroidal_state(pose.p_WB, pose.rpy_WB, robot.nominal_joints)
    return np.tile(state, (intervals + 1, 1)), weight_bearing_inputs(np.ones((intervals, NUM_LEGS), dtype=bool), robot.mass)


def weight_bearing_inputs(stance: np.ndarray, mass: float) -> np.ndarray:
    """Inputs (N, 24) in which the stance feet, bool (N, 4), share the weight and no joint moves."""
    inputs = np.zeros((len(stance), INPUT_SIZE))
    share = mass * GRAVITY / np.maximum(stance.sum(axis=1), 1)
    inputs[:, CentroidalInput.VERTICAL_FORCES] = stance * share[:, None]
    return inputs


def sampled_states(reference: WholeBodyReference, times: np.ndarray, yaw: float) -> np.ndarray:
    """Reference states at ``times`` (n, 24), linear in between, at rest outside; yaw continued from the present ``yaw``."""
    states = interpolated(times, reference.times, reference.states)
    outside = (times < reference.times[0]) | (times > reference.end_time)
    states[outside, CentroidalState.MOMENTUM] = 0.0
    yaws = states[:, CentroidalState.YAW]
    yaws += whole_turns(yaw - yaws[0])
    return states


def interval_stance(schedule: ContactSchedule, times: np.ndarray) -> np.ndarray:
    """Stance flags of each interval of ``times``, taken at its middle, bool (N, 4)."""
    middle = 0.5 * (times[:-1] + times[1:])
    return schedule.stance[np.searchsorted(schedule.event_times, middle, side="right")]


def with_early_contacts(
    stance: np.ndarray, times: np.ndarray, contacts: np.ndarray, swings: tuple, phase: float
) -> np.ndarray:
    """The planned stance flags (N, 4), where a foot that touched the ground late in its swing bears load from now on.

    The opposite, a foot that is late, stays planned as in stance on purpose: a plan without its force lets the robot sink at
    the very moment when the foot finds the ground.

    Args:
        contacts: feet that touch the ground, bool (4,).
        swings: splines of each leg that end after ``times[0]``.
        phase: part of a swing after which a touch counts as touch-down [1].
    """
    now = times[0]
    middle = 0.5 * (times[:-1] + times[1:])
    corrected = stance.copy()
    for leg in np.flatnonzero(contacts):
        for spline in swings[leg]:
            if now < spline.end_time and counts_as_touchdown(spline.start_time, spline.end_time, now, phase):
                corrected[middle < spline.end_time, leg] = True
    return corrected


@njit(cache=True)
def held_inputs(times, stance, u_ref, old_times, old_inputs):
    """The inputs (N, 24) of the last solution in the intervals of ``times`` (N + 1,).

    Where the contacts differ from those of the last solution, or it does not reach, its forces are no guess at all: there
    those of ``u_ref`` (N, 24) stand in.
    """
    inputs = np.empty_like(u_ref)
    last, k = len(old_inputs) - 1, 0
    for i in range(len(inputs)):
        middle = 0.5 * (times[i] + times[i + 1])
        while k < last and old_times[k + 1] <= middle:
            k += 1
        useful = middle <= old_times[-1]
        for leg in range(NUM_LEGS):
            load = 0.0
            for j in range(3 * leg, 3 * leg + 3):
                load += abs(old_inputs[k, j])
            useful = useful and (load > _NO_FORCE) == stance[i, leg]
        for j in range(INPUT_SIZE):
            inputs[i, j] = old_inputs[k, j] if useful or j >= _JOINT_RATES else u_ref[i, j]
    return inputs
