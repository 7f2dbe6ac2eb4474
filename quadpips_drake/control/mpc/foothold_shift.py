"""Footholds that move with the robot: where a coming touch-down has to be so that a robot off its reference regains balance.

A robot whose base is off by e and too fast by de/dt falls, as an inverted pendulum of height h does, about the point

    xi = e + sqrt(h / g) de/dt

beside its feet (the capture point: J. Pratt et al., Humanoids 2006). The next touch-down of each leg is moved by as much,
less what the forces on the ground take care of, and put back into its region if it would leave that (QuadPiPS section VII-B
lets the MPC choose footholds; here they are chosen before the program is made, so that it stays a quadratic one). From the
middle of its swing on a foot goes where it was told to go last.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.planning.region_table import nearest_in_polygon
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.reference import FootholdTarget

_SAME_TOUCHDOWN = 1e-6
"""Touch-downs of a leg closer than this are one [s]."""
_LATEST = 0.5
"""Part of a swing from which on its foothold stays [1]."""


@configuration
class FootholdShiftConfig:
    """How far the MPC moves footholds."""

    max_shift: float = ranged(0.0, 0.0, 0.5)
    """Longest way from the planned foothold [m]; 0: footholds stay where they were planned."""
    gain: float = ranged(1.0, 0.0, 10.0)
    """Part of the capture point's error by which a foothold moves [1]."""
    dead_zone: float = ranged(0.03, 0.0, 1.0)
    """What the forces on the ground take care of [m]."""


@dataclass(frozen=True, eq=False)
class FootholdShift:
    """By how much one coming touch-down is moved."""

    leg: int
    touchdown_time: float
    """[s]"""
    offset: np.ndarray
    """In W [m], (3,)."""


def capture_point_error(x: np.ndarray, reference: np.ndarray, height: float) -> np.ndarray:
    """By how much the capture point of state ``x`` (24,) is off that of ``reference`` (24,), in xy of W [m], (2,).

    ``height``: of the centre of mass above the feet [m].
    """
    position, velocity = ((x - reference)[part][:2] for part in (CentroidalState.POSITION, CentroidalState.LINEAR))
    return position + np.sqrt(max(height, 0.0) / GRAVITY) * velocity


def shifts(
    error: np.ndarray, footholds: Sequence[FootholdTarget], before: tuple, now: float, config: FootholdShiftConfig
) -> tuple[FootholdShift, ...]:
    """The shifts of all touch-downs to come: of each leg's next one anew until the middle of its swing.

    Args:
        error: of the capture point in W [m], (2,).
        footholds: of the reference, in order of touch-down.
        before: the shifts of the last time.
        now: [s].
    """
    if config.max_shift == 0.0:
        return ()
    size = float(np.hypot(*error))
    wanted = min(config.gain * max(size - config.dead_zone, 0.0), config.max_shift)
    way = np.array([*error, 0.0]) * (wanted / max(size, 1e-9))
    found, seen = [], set()
    for target in footholds:
        if target.touchdown_time <= now or target.leg in seen:
            continue
        seen.add(target.leg)
        middle = target.liftoff_time + _LATEST * (target.touchdown_time - target.liftoff_time)
        offset = _within_region(target, way) if now < middle else _offset_of(target, before)
        found.append(FootholdShift(int(target.leg), target.touchdown_time, offset))
    return tuple(found)


def shifted(footholds: tuple, moved: tuple[FootholdShift, ...]) -> tuple:
    """The footholds at their new places."""
    if not any(shift.offset.any() for shift in moved):
        return footholds
    places = ((target, _offset_of(target, moved)) for target in footholds)
    return tuple(replace(target, position=target.position + offset) if offset.any() else target for target, offset in places)


def _offset_of(target: FootholdTarget, moved: tuple[FootholdShift, ...]) -> np.ndarray:
    """By how much a touch-down was moved [m], (3,)."""
    for shift in moved:
        if shift.leg == target.leg and abs(shift.touchdown_time - target.touchdown_time) < _SAME_TOUCHDOWN:
            return shift.offset
    return np.zeros(3)


def _within_region(target: FootholdTarget, way: np.ndarray) -> np.ndarray:
    """The way in the plane of the region, as far as its inset reaches; none on ground that nothing is known about."""
    region = target.region
    if region is None or len(region.inset) < 3 or not way.any():
        return np.zeros(3)
    R = region.X_WR[:3, :3]
    way = way - np.array([0.0, 0.0, (R[0, 2] * way[0] + R[1, 2] * way[1]) / R[2, 2]])
    start = (R.T @ (target.position - region.center))[:2]
    end = start + (R.T @ way)[:2]
    u, v, _ = nearest_in_polygon(*end, np.array(region.inset, float), len(region.inset))
    return R[:, :2] @ ([u, v] - start)
