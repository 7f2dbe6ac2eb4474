"""Planned contacts meet sensed ones: what each foot does now, and how it should accelerate."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.control.early_contact import counts_as_touchdown
from quadpips_drake.trajectory.swing.swing_kernels import END, PATH_SIZE, START, evaluate_swing
from quadpips_drake.values.legs import NUM_LEGS
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.whole_body_command import FootMode

_STANCE, _SWING, _EARLY, _SEARCH = (int(mode) for mode in FootMode)  # for compiled functions


@dataclass(frozen=True, eq=False)
class FootTargets:
    """Wishes for the four feet at one instant."""

    modes: np.ndarray
    """FootMode of each foot, int (4,)."""
    positions: np.ndarray
    """Where the foot centres should be in W [m], (4, 3); a foot on the ground should be where it is."""
    velocities: np.ndarray
    """How fast they should move in W [m/s], (4, 3)."""
    accelerations: np.ndarray
    """Wanted accelerations of the foot centres in W [m/s^2], (4, 3)."""

    @property
    def contacts(self) -> np.ndarray:
        """Feet that bear load, bool (4,)."""
        return (self.modes == _STANCE) | (self.modes == _EARLY)


class FootSettings(NamedTuple):
    """What ``aim_feet`` needs of WbcConfig."""

    swing_kp: float
    swing_kd: float
    stance_damping: float
    search_speed: float
    search_depth: float
    early_contact_phase: float

    @staticmethod
    def of(config) -> "FootSettings":
        """Those of a WbcConfig."""
        return FootSettings(*(float(getattr(config, name)) for name in FootSettings._fields))


NO_SWING = np.full(PATH_SIZE, np.nan)
"""Stands for the path of a swing where there is none: it may have been dropped on its way."""


def current_paths(policy: MpcPolicy, time: float) -> tuple[np.ndarray, ...]:
    """For each leg the path of its swing in progress, else of its last one, else NO_SWING."""
    paths = []
    for splines in policy.swings:
        path = NO_SWING
        for spline in splines:
            if spline.start_time <= time:
                path = spline.path
        paths.append(path)
    return tuple(paths)


@njit(cache=True)
def bears(mode):
    """Whether a foot in that mode bears load."""
    return mode in (_STANCE, _EARLY)


@njit(cache=True)
def foot_mode(planned_down, sensed, last, path, time, early_phase):
    """Mode of one foot: an integer of FootMode.

    Args:
        planned_down: the schedule wants it on the ground.
        sensed: it touches the ground.
        last: its FootMode so far.
        path: of its swing in progress, else of its last one, else NO_SWING.
        time: now [s].
        early_phase: part of a swing after which a touch counts as touch-down [1].
    """
    if planned_down:
        # Once down, a foot stays in stance until its next swing: a touch-down bounces, and a foot unloaded for a while
        # has to be loaded again, not taken out of the plan.
        return _STANCE if sensed or last == _STANCE else _SEARCH
    if sensed and counts_as_touchdown(path[START], path[END], time, early_phase):  # never where they are NaN
        return _EARLY
    return _SWING


@njit(cache=True)
def aim_feet(settings, time, contacts, planned, last, normals, paths, p_WF, v_WF, modes, p_d, v_d, accelerations):
    """Fills modes (4,), wanted positions, velocities and accelerations (4, 3) of all feet; see ``foot_targets``.

    Args:
        settings: FootSettings.
        time: now [s].
        contacts, planned: sensed and planned ones, bool (4,).
        last: FootModes so far, (4,).
        normals: unit normals of the ground under the feet, (4, 3).
        paths: four arrays as from ``current_paths``.
        p_WF, v_WF: foot centres and their velocities in W, (4, 3).
    """
    moment = np.empty((3, 3))
    for leg in range(NUM_LEGS):
        path = paths[leg]
        is_known = not np.isnan(path[START])
        mode = foot_mode(planned[leg], contacts[leg], last[leg], path, time, settings.early_contact_phase)
        modes[leg], gain = mode, settings.stance_damping
        for i in range(3):
            moment[0, i], moment[1, i], moment[2, i] = p_WF[leg, i], 0.0, 0.0
        if mode == _SWING and is_known:
            gain = settings.swing_kd
            evaluate_swing(path, time, moment)
        elif mode == _SEARCH:
            gain = settings.swing_kd
            if is_known:
                evaluate_swing(path, path[END], moment)
            else:
                moment[0, 2] = _ground_height(p_WF, contacts, leg)
            _search(normals[leg], p_WF[leg], settings, moment)
        for i in range(3):
            p_d[leg, i], v_d[leg, i] = moment[0, i], moment[1, i]
            feedback = settings.swing_kp * (moment[0, i] - p_WF[leg, i]) + gain * (moment[1, i] - v_WF[leg, i])
            accelerations[leg, i] = moment[2, i] + feedback


@njit(cache=True)
def _search(normal, p, settings, moment):
    """Wanted position and velocity of a foot that is lowered along ``normal`` past the point moment[0], which they
    replace."""
    depth = 0.0
    for i in range(3):
        depth += normal[i] * (moment[0, i] - p[i])
    speed = settings.search_speed if depth < settings.search_depth else 0.0
    for i in range(3):
        moment[0, i] -= depth * normal[i]
        moment[1, i], moment[2, i] = -speed * normal[i], 0.0


@njit(cache=True)
def _ground_height(p_WF, contacts, leg):
    """Where a foot may meet the ground straight below: at the height of the feet that touch it."""
    total, bearing = 0.0, 0
    for other in range(NUM_LEGS):
        if contacts[other]:
            total += p_WF[other, 2]
            bearing += 1
    return total / bearing if bearing > 0 else p_WF[leg, 2]


def foot_targets(
    state: RobotState, policy: MpcPolicy, planned: np.ndarray, last: np.ndarray, p_WF: np.ndarray, v_WF: np.ndarray, config
) -> FootTargets:
    """Modes and wanted accelerations of all feet.

    A stance foot is decelerated, a swing foot follows its spline: a = a_d + Kp (p_d - p) + Kd (v_d - v), a searching foot
    goes down along the normal at constant speed: below the end of its swing, or, when that has been dropped on its way, from
    where it is.

    Args:
        state: measured state.
        policy: MPC policy with the splines.
        planned: stance flags of the schedule now, bool (4,).
        last: FootModes so far, (4,).
        p_WF, v_WF: foot centres and their velocities in W, (4, 3).
        config: WbcConfig.
    """
    time = float(state.stamp)
    targets = FootTargets(np.empty(NUM_LEGS, dtype=int), *(np.empty((NUM_LEGS, 3)) for _ in range(3)))
    settings, paths = FootSettings.of(config), current_paths(policy, time)
    aim_feet(
        settings, time, state.contacts, planned, last, policy.normals, paths, p_WF, v_WF,
        targets.modes, targets.positions, targets.velocities, targets.accelerations,
    )  # fmt: skip
    return targets
