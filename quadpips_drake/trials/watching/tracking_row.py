"""What is asked of a robot at one moment and what becomes of it, as columns of the log: what explains an end afterwards."""

import numpy as np

from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.trials.observation import Observation
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.legs import NUM_LEGS, Leg
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.status import SAFETY_EVENTS


def tracking_row(seen: Observation) -> dict[str, np.ndarray]:
    """Columns of one sample; frame W, NaN for what was not asked for.

    Returns: ``reference_rpy_WB`` [rad] (3,); ``asked_contacts`` of the MPC, bool (4,), and of the feet that it lets swing
        ``asked_feet`` and ``asked_footholds``, foot centres now and at the end [m] (4, 3), and ``swing_times``, lift-off and
        touch-down [s] (4, 2); ``planned_forces`` on the feet [N] (4, 3) and ``foot_modes`` (4,) of whole-body control;
        ``touching``, which of LINK_NAMES touch anything other than with a foot, bool; ``touching_itself``, two links that
        touch each other, as numbers in LINK_NAMES, else -1, (2,); ``mpc_age`` of the state that the policy in force started
        from [s]; ``mpc_failures``, ``wbc_failures``: of the solvers so far; ``unstable``: 0, or 1 + the number of the
        event among SAFETY_EVENTS.
    """
    now, policy, safety = seen.robot_state.stamp, seen.mpc_policy, seen.safety_status
    return {
        "reference_rpy_WB": _reference_attitude(seen.reference, now),
        "asked_contacts": policy.schedule.at(now),
        **_swings(policy, now),
        "planned_forces": seen.command.forces,
        "foot_modes": seen.command.foot_modes,
        "touching": np.array([link in seen.touching for link in LINK_NAMES]),
        "touching_itself": np.array(
            [LINK_NAMES.index(link) for link in seen.itself[0]] if seen.itself else [-1, -1], dtype=np.int8
        ),
        "mpc_age": now - policy.stamp if np.isfinite(policy.stamp) else np.nan,
        "mpc_failures": policy.fallbacks,
        "wbc_failures": seen.command.fallbacks,
        "unstable": np.int8(1 + SAFETY_EVENTS.index(safety.event) if safety.unstable else 0),
    }


def _reference_attitude(reference: WholeBodyReference, time: float) -> np.ndarray:
    """Roll, pitch, yaw in the reference [rad], held at its ends, (3,); NaN without samples."""
    if reference is None or len(reference.times) == 0:
        return np.full(3, np.nan)
    return np.array([np.interp(time, reference.times, c) for c in reference.states[:, CentroidalState.ORIENTATION].T])


def _swings(policy: MpcPolicy, time: float) -> dict[str, np.ndarray]:
    """The swings under way: where the feet are to be, where and when they end."""
    points, ends, times = np.full((NUM_LEGS, 3), np.nan), np.full((NUM_LEGS, 3), np.nan), np.full((NUM_LEGS, 2), np.nan)
    stance = policy.schedule.at(time)
    for leg in Leg:
        swing = None if stance[leg] else policy.swing(leg, time)
        if swing is not None:
            points[leg], ends[leg] = swing.position(time), swing.end_point
            times[leg] = swing.start_time, swing.end_time
    return {"asked_feet": points, "asked_footholds": ends, "swing_times": times}
