"""How well a walk followed its commands, from its log."""

import numpy as np

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.gaits.gait_timeline import schedule_of
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE
from quadpips_drake.values.reference import WholeBodyReference

ACCELERATION_TIME = 2.0
"""So long after a command [s] its velocity should have been reached."""


class FootholdBook:
    """The last word on each foothold of a rolling reference: the target that held when its foot came down."""

    def __init__(self):
        self._targets: dict = {}

    def note(self, reference: WholeBodyReference, time: float) -> None:
        """Takes the footholds of swings that are under way at ``time`` [s]."""
        for target in reference.footholds:
            if target.liftoff_time <= time <= target.touchdown_time:
                self._targets[target.leg, round(target.touchdown_time, 4)] = target

    def reference(self, until: float) -> WholeBodyReference:
        """One reference with all footholds and their schedule, from the beginning to ``until`` [s]."""
        targets = sorted(self._targets.values(), key=lambda target: target.touchdown_time)
        schedule = schedule_of([(target.leg, target.liftoff_time, target.touchdown_time) for target in targets])
        times = np.array([0.0, until])
        return WholeBodyReference(
            0.0, 1, times, np.zeros((2, STATE_SIZE)), np.zeros((2, INPUT_SIZE)), schedule, tuple(targets)
        )


def walk_statistics(arrays: dict, commands: list[WalkCommand]) -> dict:
    """Velocities against commands, and how steady the body was.

    Args:
        arrays: of the TrialLog of a walk.
        commands: in order.

    Returns: "max_tilt" [rad], "height_range" [m] (highest less lowest base above the mean of its feet), and "commands": for
        each command its gait, velocity, the time [from, to] that counts (ACCELERATION_TIME after it to the next one), the
        mean velocity in the heading frame [m/s, m/s, rad/s] (None when nothing counts) and the error [same units].
    """
    time = arrays["time"]
    ends = [command.time for command in commands[1:]] + [np.inf]
    followed = []
    for command, end in zip(commands, ends, strict=True):
        counts = (time >= command.time + ACCELERATION_TIME) & (time <= end)
        entry = {"gait": command.gait, "velocity": list(command.velocity)}
        if np.count_nonzero(counts) > 1:
            mean = mean_velocity(arrays, counts)
            error = mean - command.velocity
            entry["from"], entry["to"] = (round(float(t), 3) for t in time[counts][[0, -1]])
            entry["mean_velocity"], entry["error"] = np.round(mean, 4).tolist(), np.round(error, 4).tolist()
        followed.append(entry)
    height = arrays["p_WB"][:, 2] - arrays["foot_positions"][:, :, 2].mean(axis=1)
    return {
        "commands": followed,
        "max_tilt": round(float(np.abs(arrays["rpy_WB"][:, :2]).max()), 4),
        "height_range": round(float(np.ptp(height)), 4),
    }


def mean_velocity(arrays: dict, counts: np.ndarray) -> np.ndarray:
    """Mean of forward, left [m/s] and turning velocity [rad/s] of the base over the samples in the mask ``counts``, (3,)."""
    yaw, v = arrays["rpy_WB"][counts, 2], arrays["v_WB"][counts]
    forward = np.cos(yaw) * v[:, 0] + np.sin(yaw) * v[:, 1]
    left = -np.sin(yaw) * v[:, 0] + np.cos(yaw) * v[:, 1]
    return np.array([forward.mean(), left.mean(), arrays["w_WB"][counts, 2].mean()])
