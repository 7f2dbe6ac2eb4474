"""How well a walk followed its commands, from its log."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from quadpips_drake.control.references.velocity_reference import STANCE
from quadpips_drake.gaits.gait_timeline import schedule_of
from quadpips_drake.gaits.gaits import gait_names, gait_number
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE
from quadpips_drake.values.reference import WholeBodyReference

ACCELERATION_TIME = 2.0
"""So long after a command [s] its velocity should have been reached."""
SHORT = 0.5
"""Commands that hold for less are taken together [s]."""


class FootholdBook:
    """The last word on each foothold of a rolling reference: the target that held when its foot came down."""

    def __init__(self):
        self._targets: dict = {}

    def __bool__(self):
        return bool(self._targets)

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


@dataclass(frozen=True)
class Stretch:
    """A part of a walk with one gait and one velocity command."""

    gait: str
    velocity: np.ndarray
    """Forward, left [m/s], turn [rad/s], (3,); the mean where commands came faster than SHORT after each other."""
    begin: float
    """[s]"""
    end: float
    """When the next one begins [s]; of the last one, the last sample."""
    varies: bool = False
    """Whether ``velocity`` is such a mean."""


def stretches_of(arrays: dict) -> list[Stretch]:
    """What a walk was told to do, from its log: the commands as they came, whoever gave them.

    Standing before the first command is none. Commands that followed each other faster than SHORT in the same gait, as they
    come from a slider or a gamepad that is moved, are one.
    """
    time, gaits, velocities = arrays["time"], arrays["gait"], arrays["velocity_command"]
    changed = (np.diff(gaits) != 0) | (np.diff(velocities, axis=0) != 0.0).any(axis=1)
    firsts = [0, *(np.flatnonzero(changed) + 1).tolist()]
    afters = [*firsts[1:], len(time)]
    names = {gait_number(name): name for name in gait_names()}
    groups: list[list[int]] = []
    short_before = False
    for first, after in zip(firsts, afters, strict=True):
        short = time[min(after, len(time) - 1)] - time[first] < SHORT
        if short and short_before and gaits[first] == gaits[groups[-1][0]]:
            groups[-1][1] = after
            groups[-1][2] = True
        else:
            groups.append([first, after, False])
        short_before = short
    found = [
        Stretch(
            names[int(gaits[first])],
            velocities[first:after].mean(axis=0) if varies else velocities[first],
            float(time[first]),
            float(time[min(after, len(time) - 1)]),
            bool(varies),
        )
        for first, after, varies in groups
    ]
    before = found[0]
    stood = before.gait == STANCE and not before.velocity.any() and len(found) > 1
    return found[1:] if stood else found


def walk_statistics(arrays: dict, feasible: Callable[[np.ndarray, str], np.ndarray]) -> dict:
    """Velocities against commands, and how steady the body was.

    Args:
        arrays: of the TrialLog of a walk.
        feasible: (velocity command, name of a gait) -> what the legs can do of it, (3,).

    Returns: "max_tilt" [rad], "height_range" [m] (highest less lowest base above the mean of its feet), and "commands": for
        each stretch its gait, velocity command, "begin" and "end" [s]; "feasible_velocity" if it was limited to that;
        "varies": True if the command is the mean of several; and if the stretch was long enough, the time [from, to] that
        counts (ACCELERATION_TIME after its begin to its end), the mean velocity in the heading frame
        [m/s, m/s, rad/s] and its error against the command [same units].
    """
    time = arrays["time"]
    followed = []
    for stretch in stretches_of(arrays):
        counts = (time >= stretch.begin + ACCELERATION_TIME) & (time <= stretch.end)
        entry = {"gait": stretch.gait, "velocity": np.round(stretch.velocity, 6).tolist()}
        entry["begin"], entry["end"] = round(stretch.begin, 3), round(stretch.end, 3)
        limited = feasible(stretch.velocity, stretch.gait)
        if not np.allclose(limited, stretch.velocity, rtol=1e-9, atol=1e-9):
            entry["feasible_velocity"] = np.round(limited, 4).tolist()
        if stretch.varies:
            entry["varies"] = True
        if np.count_nonzero(counts) > 1:
            mean = mean_velocity(arrays, counts)
            error = mean - stretch.velocity
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
