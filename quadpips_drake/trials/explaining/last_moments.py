"""What was asked of a robot and what it did, over the last seconds of a trial."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.watching.notes import SAFETY, STABLE_AGAIN

SPAN = 10.0
"""How much of the end of a trial is looked at [s]."""
SHOWN = 2.0
"""How much of it is shown at least [s]."""
_COLUMNS = {
    "time": "time",
    "feet": "foot_positions",
    "asked_feet": "asked_feet",
    "footholds": "asked_footholds",
    "swing_times": "swing_times",
    "contacts": "contacts",
    "asked_contacts": "asked_contacts",
    "touches": "touching",
    "forces": "contact_forces",
    "joints": "joint_positions",
    "torques": "joint_torques",
}
"""Of LastMoments, and where the log has them."""


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


def moments_of(log: Mapping, robot, terrain, span: float = SPAN) -> LastMoments | None:
    """The last ``span`` [s] of a log; None of one without samples, or that does not say what was asked.

    Args:
        log: arrays of log.npz.
        robot: RobotModel.
        terrain: the true one, for the ground under the feet; None: not known.
    """
    if "asked_contacts" not in log or len(log["asked_contacts"]) == 0:
        return None
    since = log["time"][-1] - span - 1e-9
    kept = slice(int(np.searchsorted(log["time"], since)), None)
    arrays = {name: np.asarray(log[column][kept]) for name, column in _COLUMNS.items()}
    ground, foothold_ground = (
        _ground_at(terrain, points) for points in (arrays["feet"], np.nan_to_num(arrays["footholds"], nan=1e6))
    )
    pairs = np.asarray(log["touching_itself"][kept])
    met = [(float(arrays["time"][k]), *(LINK_NAMES[link] for link in pairs[k])) for k in np.flatnonzero(pairs[:, 0] >= 0)]
    said = zip(log["note_time"], log["note_source"], log["note_text"], strict=True)
    return LastMoments(
        **arrays,
        base=np.hstack((log["p_WB"][kept], log["rpy_WB"][kept])),
        asked_base=np.hstack((log["reference_p_WB"][kept], log["reference_rpy_WB"][kept])),
        joint_limits=np.stack((robot.position_limits_lower, robot.position_limits_upper)),
        torque_limits=robot.effort_limits,
        joint_names=tuple(robot.joint_names),
        ground=ground,
        foothold_ground=foothold_ground,
        foot_radius=robot.foot_radius,
        itself=tuple(met),
        told=tuple(
            (float(time), f"the safety monitor took the reference away: {text}")
            for time, who, text in said
            if who == SAFETY and text != STABLE_AGAIN and time >= arrays["time"][0]
        ),
    )


def _ground_at(terrain, points: np.ndarray) -> np.ndarray:
    """True heights [m] at x, y of points (n, 4, 3), (n, 4); NaN over nothing, and where the terrain is not known."""
    if terrain is None:
        return np.full(points.shape[:2], np.nan)
    return GroundTruth(terrain).height(points[..., 0].ravel(), points[..., 1].ravel()).reshape(points.shape[:2])
