"""What was asked of a robot and what it did, over the last seconds of a trial."""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.observation import Observation
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.legs import NUM_LEGS, Leg
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.status import SafetyStatus

SPAN = 10.0
"""How much of the end of a trial is kept [s]."""
SHOWN = 2.0
"""How much of it is shown at least [s]."""
_MOST = 2000
"""Entries of what happens now and then that are kept."""


@dataclass(frozen=True, eq=False)
class LastMoments:
    """Samples of the last SPAN; frame W, NaN for what was not asked for."""

    time: np.ndarray
    """[s], (n,)."""
    base: np.ndarray
    """x, y, z [m], roll, pitch, yaw [rad] of the base, (n, 6)."""
    asked_base: np.ndarray
    """... in the reference, (n, 6); NaN while there is none."""
    feet: np.ndarray
    """Foot centres [m], (n, 4, 3)."""
    asked_feet: np.ndarray
    """Where the swings of the MPC have them [m], (n, 4, 3); NaN for feet that are to stand."""
    footholds: np.ndarray
    """Foot centres where these swings end [m], (n, 4, 3); NaN for feet that are to stand."""
    swing_times: np.ndarray
    """Lift-off and touch-down of these swings [s], (n, 4, 2); NaN for feet that are to stand."""
    contacts: np.ndarray
    """Whether each foot touches anything, bool (n, 4)."""
    asked_contacts: np.ndarray
    """Whether it is to stand, bool (n, 4)."""
    touches: np.ndarray
    """Whether each of LINK_NAMES touches anything other than with a foot, bool (n, links)."""
    forces: np.ndarray
    """Forces on the feet [N], (n, 4, 3)."""
    joints: np.ndarray
    """Joint positions [rad], (n, 12)."""
    joint_limits: np.ndarray
    """Least and largest ones [rad], (2, 12)."""
    torques: np.ndarray
    """Of the joints [N m], (n, 12)."""
    torque_limits: np.ndarray
    """[N m], (12,)."""
    joint_names: tuple
    ground: np.ndarray
    """True height under each foot [m], (n, 4); NaN over nothing."""
    foothold_ground: np.ndarray
    """True height at the ``footholds`` [m], (n, 4); NaN over nothing."""
    foot_radius: float
    """[m]"""
    itself: tuple = ()
    """(time [s], link, link): of its own links that touch each other."""
    told: tuple = ()
    """(time [s], what the safety monitor said then)."""

    def since(self, time: float) -> "LastMoments":
        """Returns those from a time on [s]."""
        kept, whole = self.time >= time - 1e-9, ("joint_limits", "torque_limits")
        arrays = {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray) and name not in whole}
        later = {name: tuple(e for e in getattr(self, name) if e[0] >= time - 1e-9) for name in ("itself", "told")}
        return replace(self, **{name: value[kept] for name, value in arrays.items()}, **later)


class MomentRecorder:
    """Keeps the last SPAN of what is asked and what happens, sample by sample."""

    def __init__(self, log_rate: float):
        """``log_rate``: samples per second [Hz]."""
        self._rows: deque = deque(maxlen=int(np.ceil(SPAN * log_rate)) + 1)
        self._itself: deque = deque(maxlen=_MOST)
        self._told: deque = deque(maxlen=_MOST)
        self._unstable = False

    def note(self, observation: Observation, policy: MpcPolicy, safety: SafetyStatus, itself: list) -> None:
        """Takes one sample.

        Args:
            observation: what is to be seen.
            policy: what the MPC asks for.
            safety: what the safety monitor makes of it.
            itself: pairs of links that touch each other.
        """
        state = observation.robot_state
        self._rows.append(
            {
                "time": state.stamp,
                "base": np.concatenate((state.p_WB, state.rpy_WB)),
                "asked_base": _asked_base(observation.reference, state.stamp),
                "feet": observation.foot_positions,
                "contacts": state.contacts,
                "touches": np.array([link in observation.touching for link in LINK_NAMES]),
                "asked_contacts": policy.schedule.at(state.stamp),
                "forces": state.contact_forces,
                "joints": state.joint_positions,
                "torques": state.joint_torques,
                **_swings(policy, state.stamp),
            }
        )
        self._itself.extend((state.stamp, *pair) for pair in itself)
        if safety.unstable and not self._unstable:
            self._told.append((safety.stamp, f"the safety monitor took the reference away: {safety.reason}"))
        self._unstable = safety.unstable

    def moments(self, robot, terrain) -> LastMoments | None:
        """What was kept; None without any sample.

        Args:
            robot: RobotModel.
            terrain: the true one, for the ground under the feet.
        """
        if not self._rows:
            return None
        arrays = {name: np.array([row[name] for row in self._rows]) for name in self._rows[0]}
        truth = GroundTruth(terrain)
        ground, foothold_ground = (
            truth.height(points[..., 0].ravel(), points[..., 1].ravel()).reshape(points.shape[:2])
            for points in (arrays["feet"], np.nan_to_num(arrays["footholds"], nan=1e6))
        )
        return LastMoments(
            **arrays,
            joint_limits=np.stack((robot.position_limits_lower, robot.position_limits_upper)),
            torque_limits=robot.effort_limits,
            joint_names=tuple(robot.joint_names),
            ground=ground,
            foothold_ground=foothold_ground,
            foot_radius=robot.foot_radius,
            itself=tuple(entry for entry in self._itself if entry[0] >= arrays["time"][0]),
            told=tuple(entry for entry in self._told if entry[0] >= arrays["time"][0]),
        )


def _asked_base(reference: WholeBodyReference, time: float) -> np.ndarray:
    """Position and attitude in the reference, held at its ends, (6,); NaN without samples."""
    if len(reference.times) == 0:
        return np.full(6, np.nan)
    pose = np.hstack((reference.states[:, CentroidalState.POSITION], reference.states[:, CentroidalState.ORIENTATION]))
    return np.array([np.interp(time, reference.times, column) for column in pose.T])


def _swings(policy: MpcPolicy, time: float) -> dict[str, np.ndarray]:
    """The swings under way: where the feet are to be, where and when they end."""
    points, ends, times = np.full((NUM_LEGS, 3), np.nan), np.full((NUM_LEGS, 3), np.nan), np.full((NUM_LEGS, 2), np.nan)
    for leg in Leg:
        swing = None if policy.schedule.at(time)[leg] else policy.swing(leg, time)
        if swing is not None:
            points[leg], ends[leg] = swing.position(time), swing.end_point
            times[leg] = swing.start_time, swing.end_time
    return {"asked_feet": points, "footholds": ends, "swing_times": times}
