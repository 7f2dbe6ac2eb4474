"""Planned contacts meet sensed ones: what each foot does now, and how it should accelerate."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.control.early_contact import counts_as_touchdown
from quadpips_drake.values.legs import NUM_LEGS
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.whole_body_command import FootMode

_STANCE, _SWING, _EARLY, _SEARCH = (int(mode) for mode in FootMode)  # comparing enum members takes microseconds


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


def foot_mode(planned_down: bool, sensed: bool, last: int, spline, time: float, early_phase: float) -> FootMode:
    """Mode of one foot.

    Args:
        planned_down: the schedule wants it on the ground.
        sensed: it touches the ground.
        last: its FootMode so far.
        spline: its SwingSpline in progress, else its last one, else None (a swing may have been dropped on its way).
        time: now [s].
        early_phase: part of a swing after which a touch counts as touch-down [1].
    """
    if planned_down:
        # Once down, a foot stays in stance until its next swing: a touch-down bounces, and a foot unloaded for a while
        # has to be loaded again, not taken out of the plan.
        return FootMode.STANCE if sensed or last == _STANCE else FootMode.SEARCH
    if sensed and spline is not None and counts_as_touchdown(spline, time, early_phase):
        return FootMode.EARLY
    return FootMode.SWING


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
    time = state.stamp
    modes = np.zeros(NUM_LEGS, dtype=int)
    p_d, v_d = p_WF.copy(), np.zeros((NUM_LEGS, 3))
    a_d, gain = np.zeros((NUM_LEGS, 3)), np.full((NUM_LEGS, 1), config.stance_damping)
    for leg in range(NUM_LEGS):
        spline = policy.swing(leg, time)
        modes[leg] = foot_mode(planned[leg], state.contacts[leg], last[leg], spline, time, config.early_contact_phase)
        if modes[leg] == _SWING and spline is not None:
            gain[leg] = config.swing_kd
            p_d[leg], v_d[leg], a_d[leg] = spline.evaluate(time)
        elif modes[leg] == _SEARCH:
            gain[leg] = config.swing_kd
            end = _ground_below(p_WF, state.contacts, leg) if spline is None else spline.evaluate(spline.end_time)[0]
            p_d[leg], v_d[leg] = _search(end, policy.normals[leg], p_WF[leg], config)
    accelerations = a_d + config.swing_kp * (p_d - p_WF) + gain * (v_d - v_WF)
    return FootTargets(modes, p_d, v_d, accelerations)


def _search(end, normal, p, config) -> tuple[np.ndarray, np.ndarray]:
    """Wanted position and velocity of a foot that is lowered along ``normal`` past the point ``end``."""
    depth = normal @ (end - p)
    speed = config.search_speed if depth < config.search_depth else 0.0
    return end - depth * normal, -speed * normal


def _ground_below(p_WF, contacts, leg: int) -> np.ndarray:
    """Where a foot may meet the ground straight below: at the height of the feet that touch it."""
    end = p_WF[leg].copy()
    if contacts.any():
        end[2] = p_WF[contacts, 2].mean()
    return end
