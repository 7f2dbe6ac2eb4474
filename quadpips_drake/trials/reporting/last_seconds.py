"""The last two seconds of a trial in words: what was asked, and what the robot did."""

from collections.abc import Iterator

import numpy as np

from quadpips_drake.gaits.gaits import gait_names, gait_number
from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.trials.explaining.last_moments import SHOWN
from quadpips_drake.trials.reporting.case import Case
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.status import PlannerPhase


def what_was_asked(case: Case, span: float = SHOWN) -> Iterator[str]:
    """Sentences about the last ``span`` [s]."""
    log, kept = case.log, _kept(case, span)
    if "velocity_command" in log:
        names = {gait_number(name): name for name in gait_names()}
        gait = names.get(int(log["gait"][-1]), "an unknown gait") if "gait" in log else "its gait"
        yield f"{gait} at {velocity_in_words(log['velocity_command'][-1].tolist())}"
    if "phase" in log:
        phases = list(PlannerPhase)
        passed = [phases[int(n)] for n in log["phase"][kept] if 0 <= n < len(phases)]
        yield "the planner was " + ", then ".join(str(phase).replace("_", " ") for phase in dict.fromkeys(passed))
    reference = log["reference_p_WB"][kept] if "reference_p_WB" in log else np.zeros((0, 3))
    known = np.flatnonzero(np.isfinite(reference).all(axis=1))
    if len(known) > 1:
        way = reference[known[-1]] - reference[known[0]]
        lost = "" if len(known) == len(reference) else f"; for {_seconds(log, kept, len(reference) - len(known))} s nothing"
        yield f"the base: {np.hypot(*way[:2]):.2f} m along the ground, {way[2]:+.2f} m in height{lost}"
    elif len(reference):
        yield "the base: nothing, there was no reference"
    if "asked_contacts" in log:
        lifts = [np.count_nonzero(np.diff(log["asked_contacts"][kept, leg].astype(int)) < 0) for leg in Leg]
        yield "lift-offs: " + ", ".join(f"{leg.name} {lifts[leg]}" for leg in Leg)


def what_happened(case: Case, span: float = SHOWN) -> Iterator[str]:
    """Sentences about the last ``span`` [s]."""
    log, kept = case.log, _kept(case, span)
    base, rpy = log["p_WB"][kept], log["rpy_WB"][kept]
    yield (
        f"the base: {np.hypot(*(base[-1] - base[0])[:2]):.2f} m along the ground, height {base[0, 2]:.2f} m, then "
        f"{base[:, 2].min():.2f} m at least and {base[-1, 2]:.2f} m at last"
    )
    tilts = [
        (abs(rpy[k, i]), rpy[k, i], name) for i, name in enumerate(("roll", "pitch")) for k in (np.abs(rpy[:, i]).argmax(),)
    ]
    yield "largest tilt: " + ", ".join(f"{name} {value:+.2f} rad" for _, value, name in tilts)
    robot = case.record.robot
    if robot is not None:
        parts = np.abs(log["joint_torques"][kept]) / robot.effort_limits
        joint = int(np.nanmax(parts, axis=0).argmax())
        yield f"largest torque: {np.nanmax(parts):.0%} of its limit, joint {robot.joint_names[joint]}"
    moved = [float(np.nanmax(_slide(log, kept, leg), initial=0.0)) for leg in Leg]
    yield "farthest that a foot slid while it stood: " + ", ".join(f"{leg.name} {100 * moved[leg]:.0f} cm" for leg in Leg)
    for name in ("mpc", "wbc"):
        counts = log.get(f"{name}_failures")
        if counts is not None and counts[-1] > counts[kept][0]:
            yield f"the {name.upper()}'s solver failed {int(counts[-1] - counts[kept][0])} times"
    links = _links(case, kept)
    if links:
        yield f"touched something other than with a foot: {', '.join(links)}"


def velocity_in_words(velocity) -> str:
    """A velocity in the heading frame: forward, left [m/s], turn [rad/s]."""
    if not (isinstance(velocity, list | tuple) and len(velocity) == 3 and all(isinstance(v, int | float) for v in velocity)):
        return "?"
    forward, left, turn = velocity
    return f"{forward:.2f} m/s forward, {left:.2f} m/s to the left, {turn:.2f} rad/s"


def _kept(case: Case, span: float) -> slice:
    """The samples of the last ``span`` [s]."""
    time = case.log["time"]
    return slice(int(np.searchsorted(time, time[-1] - span - 1e-9)), None)


def _seconds(log, kept: slice, samples: int) -> str:
    """How long a number of samples lasts."""
    time = log["time"][kept]
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    return f"{samples * step:.2f}"


def _slide(log, kept: slice, leg: Leg) -> np.ndarray:
    """How far the foot of a leg was from where it last came down, along the ground, while it touched it [m]."""
    down = log["contacts"][kept, leg].astype(bool)
    feet = log["foot_positions"][kept, leg, :2]
    fresh = down & ~np.concatenate(([False], down[:-1]))
    last = np.maximum.accumulate(np.where(fresh, np.arange(len(down)), -1))
    anchored = np.where((last >= 0)[:, None], feet[np.maximum(last, 0)], np.nan)
    return np.where(down, np.hypot(*(feet - anchored).T), 0.0)


def _links(case: Case, kept: slice) -> list[str]:
    """Names of the links that touched something in these samples."""
    touching = case.log.get("touching")
    if touching is None:
        return []
    return [name for name, flags in zip(LINK_NAMES, touching[kept].T, strict=True) if flags.any()]
