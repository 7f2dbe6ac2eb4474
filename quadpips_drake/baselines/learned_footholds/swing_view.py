"""What the network of footholds sees before a swing: the ground near where the foot wants to go, the stance, the way.

All of it in the heading of the feet that stay down, as a left leg would see it: for a right leg left and right are swapped.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from quadpips_drake.planning.footholds.stance_transitions import pose_of_stance_legs
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS, Leg

PATCH = 11
"""Cells along each side of the patch of heights [1]."""
_CELL_SHARE = 0.08
"""Side of a cell as part of the robot's nominal base height [1]."""
_DEEP = 6.0
"""Ground counts as so many cells higher or lower than the feet at most; no ground as so much lower [1]."""
INPUTS = PATCH * PATCH + 3 * NUM_LEGS + 2 + 1
"""Heights of the patch, row by row from behind, right to left; x, y of all feet beside their nominal places; their heights;
the way of the base within the swing, x, y; 1 for a fore leg, -1 for a hind one. In m."""
_GRID = np.stack(np.meshgrid(*2 * [np.arange(PATCH) - 0.5 * (PATCH - 1)], indexing="ij"), axis=-1).reshape(-1, 2)
_OPPOSITE = [Leg.RF, Leg.LF, Leg.RH, Leg.LH]


def patch_cell(robot) -> float:
    """Side of a cell of the patch for a RobotModel [m]."""
    return _CELL_SHARE * robot.nominal_base_height


@dataclass(frozen=True, eq=False)
class SwingView(ImmutableValue):
    """What the network sees, and from where."""

    inputs: np.ndarray
    """(INPUTS,)"""
    axes: np.ndarray
    """Unit vectors ahead and to the outside of the leg in W, as columns, (2, 2)."""
    wish: np.ndarray
    """x, y in W where the foot wants to go [m], (2,)."""

    def moved(self, offset: np.ndarray) -> np.ndarray:
        """x, y in W [m], (2,), of the wish moved by an ``offset`` ahead and outward [m], (2,)."""
        return self.wish + self.axes @ offset

    def offset(self, xy: np.ndarray) -> np.ndarray:
        """How far ahead of the wish, and outward of it, ``xy`` in W is [m], (2,)."""
        return self.axes.T @ (xy - self.wish)


def swing_view(
    feet: np.ndarray, swinging: tuple, leg: int, wish: np.ndarray, nominal: np.ndarray, cell: float, outlines
) -> SwingView | None:
    """What is to be seen before ``leg`` swings; None where fewer than two feet stay down: there is no heading then.

    Args:
        feet: ground points of all feet before the swing in W [m], (4, 3).
        swinging: the legs that swing together with ``leg``, which is one of them.
        leg: whose foothold is wanted.
        wish: x, y in W where the foot wants to go [m], (2,).
        nominal: nominal footholds in the base's heading frame, x, y [m], (4, 2).
        cell: side of a cell of the patch [m].
        outlines: RegionTable of the regions' boundaries.
    """
    away = np.zeros(NUM_LEGS, dtype=bool)
    away[list(swinging)] = True
    if away.sum() > NUM_LEGS - 2:
        return None
    x, y, yaw = pose_of_stance_legs(feet, away, 0.0, nominal)
    axes = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]) * [1.0, Leg(leg).side]
    level = float(feet[~away, 2].mean())
    heights = ground_at(outlines, wish + cell * _GRID @ axes.T) - level
    heights = np.clip(np.where(np.isfinite(heights), heights, -np.inf), -_DEEP * cell, _DEEP * cell)
    base, mirrored = np.array([x, y]), nominal * [1.0, Leg(leg).side]
    stance, lifts = (feet[:, :2] - base) @ axes - mirrored, feet[:, 2] - level
    if Leg(leg).side < 0:
        stance, lifts = stance[_OPPOSITE], lifts[_OPPOSITE]
    way = (wish - base) @ axes - mirrored[leg]
    return SwingView(np.concatenate((heights, stance.ravel(), lifts, way, [Leg(leg).fore])), axes, np.array(wish))


@njit(cache=True)
def ground_at(outlines, points):
    """Returns the height of the highest region above or below each of ``points`` (n, 2) in W [m], (n,); NaN: there is none.

    ``outlines``: RegionTable of the regions' boundaries.
    """
    heights = np.full(len(points), np.nan)
    for k in range(len(outlines.origins)):
        origin, R, polygon, count = outlines.origins[k], outlines.rotations[k], outlines.insets[k], outlines.counts[k]
        for i in range(len(points)):
            dx, dy = points[i, 0] - origin[0], points[i, 1] - origin[1]
            if dx * dx + dy * dy > outlines.radii[k] ** 2:
                continue
            dz = -(R[0, 2] * dx + R[1, 2] * dy) / R[2, 2]
            u = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz
            v = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz
            if _contains(polygon, count, u, v) and not heights[i] >= origin[2] + dz:
                heights[i] = origin[2] + dz
    return heights


@njit(cache=True)
def _contains(polygon, count, u, v):
    """Whether (u, v) is in the convex counter-clockwise polygon of the first ``count`` rows."""
    for i in range(count):
        j = (i + 1) % count
        au, av = polygon[i, 0], polygon[i, 1]
        if (polygon[j, 0] - au) * (v - av) - (polygon[j, 1] - av) * (u - au) < 0.0:
            return False
    return True
