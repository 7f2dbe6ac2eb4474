"""How well the feet did what was planned for them, and whether that was any good."""

import numpy as np

from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.penetration import sphere_depths
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.reference import SETTLING_TIME

_ENDS = 0.04
"""So long after lift-off and before touch-down a foot is on its foothold rather than on its way [s]."""
_MAX_DEFECT = 0.05
"""A swing is infeasible when its states and forces contradict the dynamics by more than this (norm over its knots) ..."""
_MAX_MISS = 0.05
"""... or when its foot comes down farther from its foothold than this [m]."""
_TOUCH = 0.25, 0.75
"""A foot that bears load between these parts of its swing has hit something [1]."""


def foothold_statistics(
    references: list,
    time: np.ndarray,
    foot_positions: np.ndarray,
    contacts: np.ndarray,
    *,
    until: list | None = None,
    miss_distance=0.05,
    slip_distance=0.03,
) -> dict:
    """Counts planned, missed and slipped footholds.

    A foothold is *missed* when the foot is more than ``miss_distance`` [m] off (horizontally) SETTLING_TIME after its
    planned touch-down or has not touched the ground by then; it is *slipped* when the foot, once down, moves more than
    ``slip_distance`` [m] horizontally before it is lifted again (or its plan ends).

    Args:
        references: the published WholeBodyReferences in order; a newer one cancels the footholds that an older one
            still had, or takes them over.
        time: sample times [s], (n,).
        foot_positions: foot centres in W [m], (n, 4, 3).
        contacts: measured contacts, (n, 4).
        until: until when each reference was in force [s] (see ``ends_in_force``); default: the stamp of the next.
    """
    counts = {"planned": 0, "slipped": 0, "missed": 0}
    errors = []
    stamps = [*(reference.stamp for reference in references[1:]), np.inf] if until is None else until
    for reference, cancelled in zip(references, stamps, strict=False):
        for foothold in reference.footholds:
            lifts = [start for start, _ in reference.schedule.swings(foothold.leg) if start > foothold.touchdown_time]
            # A leg that swings twice in a row may not stand that long.
            settled = min([foothold.touchdown_time + SETTLING_TIME, *(0.5 * (foothold.touchdown_time + t) for t in lifts)])
            if settled > min(time[-1], cancelled):
                continue
            counts["planned"] += 1
            at = int(np.searchsorted(time, settled))
            error = np.linalg.norm(foot_positions[at, foothold.leg, :2] - foothold.position[:2])
            errors.append(error)
            if error > miss_distance or not contacts[at, foothold.leg]:
                counts["missed"] += 1
            until = int(np.searchsorted(time, min([*lifts, max(reference.end_time, settled), cancelled])))
            track = foot_positions[at : max(until, at + 1), foothold.leg, :2]
            if np.linalg.norm(track - track[0], axis=1).max() > slip_distance:
                counts["slipped"] += 1
    counts["landing_error_p50"] = round(float(np.median(errors)), 4) if errors else None
    counts["landing_error_max"] = round(float(np.max(errors)), 4) if errors else None
    return counts


def ends_in_force(references: list, arrays: dict) -> list[float]:
    """Until when each reference was in force [s]: the next one came, or it was dropped because the robot was unstable.

    Args:
        references: the published WholeBodyReferences in order.
        arrays: of the log: ``time`` (n,), ``reference_p_WB`` (n, 3), which is NaN where nothing was in force.
    """
    gone = arrays["time"][np.isnan(arrays["reference_p_WB"][:, 0])]
    stamps = [*(reference.stamp for reference in references[1:]), np.inf]
    dropped = (gone[gone > reference.stamp] for reference in references)
    return [min(stamp, times.min(initial=np.inf)) for stamp, times in zip(stamps, dropped, strict=False)]


def swing_statistics(references: list, arrays: dict, robot: RobotModel, terrain: Terrain, appeared: list = ()) -> dict:
    """Counts and measures the swings that were in force.

    Args:
        references: the published WholeBodyReferences in order; swings that did not come to their end are left out.
        arrays: of the log: ``time`` (n,), ``foot_positions`` (n, 4, 3) in W [m], ``contacts`` (n, 4), and what
            ``ends_in_force`` looks at.
        robot: whose feet.
        terrain: the true one at the beginning.
        appeared: what came later: (since when [s], Terrain of that alone), ....

    Returns:
        ``swings``: how many; ``infeasible``: how many of them contradict the dynamics or miss their foothold; ``worst_m``:
        the largest depth by which a foot's sphere would go into the terrain on its way as planned; ``executed_worst_m``: by
        which it did; ``touches``: how many feet hit something on their way.
    """
    model, time = CentroidalModel(robot), arrays["time"]
    planned, executed, counts = [], [], {"swings": 0, "infeasible": 0, "touches": 0}
    for reference, until in zip(references, ends_in_force(references, arrays), strict=True):
        swings = [foothold for foothold in reference.footholds if foothold.touchdown_time <= min(until, time[-1])]
        if not swings:
            continue
        defects = _defects(model, reference)
        feet = _feet(robot, reference.states)
        for foothold in swings:
            leg, start, end = foothold.leg, foothold.liftoff_time, foothold.touchdown_time
            counts["swings"] += 1
            landed = min(int(np.searchsorted(reference.times, end + 1e-6)), len(feet) - 1)
            missed = np.linalg.norm(feet[landed, leg] - foothold.position) > _MAX_MISS
            knots = (reference.times[:-1] > start - 1e-9) & (reference.times[:-1] < end - 1e-9)
            counts["infeasible"] += bool(missed or np.sqrt((defects[knots] ** 2).sum()) > _MAX_DEFECT)
            for paths, times, points in (
                (planned, reference.times, feet[:, leg]),
                (executed, time, arrays["foot_positions"][:, leg]),
            ):
                on_the_way = (times > start + _ENDS) & (times < end - _ENDS)
                paths.append(np.column_stack((times, points))[on_the_way])
            first, last = (start + part * (end - start) for part in _TOUCH)
            counts["touches"] += bool(arrays["contacts"][(time > first) & (time < last), leg].any())
    worst = {}
    for name, paths in (("worst_m", planned), ("executed_worst_m", executed)):
        points = np.concatenate(paths) if paths else np.zeros((0, 4))
        depth = 0.0
        for since, elements in ((-np.inf, terrain), *appeared):
            there = points[points[:, 0] >= since, 1:]
            depth = max(depth, float(sphere_depths(elements, there, robot.foot_radius).max(initial=0.0)))
        worst[name] = round(depth, 4)
    return counts | worst


def _feet(robot: RobotModel, states: np.ndarray) -> np.ndarray:
    """Centres of the feet in W [m], (n, 4, 3)."""
    s = CentroidalState
    return np.array(
        [robot.foot_positions_at(x[s.POSITION], rotation_from_rpy(np.array(x[s.ORIENTATION])), x[s.JOINTS]) for x in states]
    )


def _defects(model: CentroidalModel, reference) -> np.ndarray:
    """By how much each state is not what the one before leads to (midpoint rule), (n - 1,)."""
    states, inputs, steps = reference.states, reference.inputs[:-1], np.diff(reference.times)[:, None]
    rates = np.array([model.dynamics(x, u) for x, u in zip(states[:-1], inputs, strict=True)])
    middle = states[:-1] + 0.5 * steps * rates
    rates = np.array([model.dynamics(x, u) for x, u in zip(middle, inputs, strict=True)])
    return np.linalg.norm(states[:-1] + steps * rates - states[1:], axis=1)
