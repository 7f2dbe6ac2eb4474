"""How wide, narrow, long and short a robot can stand: from its joint limits, its motors and the shapes of its legs."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.leg_shapes import leg_gap
from quadpips_drake.robots.reachability import in_leg_workspace, leg_chains
from quadpips_drake.values.legs import Leg

_STEP = 0.005
"""Resolution of the limits [m]."""
_PAIRS_ACROSS = ((Leg.LF, Leg.RF), (Leg.LH, Leg.RH))
_PAIRS_ALONG = ((Leg.LF, Leg.LH), (Leg.RF, Leg.RH))


class StanceLimits(NamedTuple):
    """Least and largest distances between the feet of a stance in B [m]; a NamedTuple, so that numba takes it as it is."""

    min_width: float
    """Left foot's y less the right one's, fore or hind."""
    max_width: float
    min_length: float
    """Fore foot's x less the hind one's, left or right."""
    max_length: float


@lru_cache(maxsize=32)
def stance_limits(robot, max_extension: float = 0.98) -> StanceLimits:
    """Moves pairs of feet together and apart from the nominal stance, the base at nominal height, as far as they go.

    A place is good while each leg reaches it within its joint limits and at most ``max_extension`` of its length; while no
    two legs are nearer to each other than the robot's ``leg_clearance``; and while no joint needs more than its
    ``effort_share`` to carry half the robot's weight straight up, as each leg of a trotting pair does.
    """
    reach = _Reach(robot, max_extension)
    nominal = np.asarray(robot.nominal_footholds_B)
    across, along = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    widths = [nominal[a, 1] - nominal[b, 1] for a, b in _PAIRS_ACROSS]
    lengths = [nominal[a, 0] - nominal[b, 0] for a, b in _PAIRS_ALONG]
    inward = min(reach.furthest(pair, across, -1.0) for pair in _PAIRS_ACROSS)
    outward = min(reach.furthest(pair, across, 1.0) for pair in _PAIRS_ACROSS)
    shorter = min(reach.furthest(pair, along, -1.0) for pair in _PAIRS_ALONG)
    longer = min(reach.furthest(pair, along, 1.0) for pair in _PAIRS_ALONG)
    bounds = (
        max(widths) - 2.0 * inward, min(widths) + 2.0 * outward, max(lengths) - 2.0 * shorter, min(lengths) + 2.0 * longer,
    )  # fmt: skip
    return StanceLimits(*map(float, bounds))


class _Reach:
    """What a pair of legs can do with the base at nominal height."""

    def __init__(self, robot, max_extension):
        self._robot = robot
        self._extension = max_extension
        self._chains = leg_chains(robot)
        self._nominal = np.asarray(robot.nominal_footholds_B)

    def furthest(self, pair, direction, sign) -> float:
        """How far each foot of ``pair`` may move from its nominal place along ``direction`` [m], the second one opposite."""
        distance = 0.0
        while self._is_good(pair, sign * (distance + _STEP) * direction) and distance < 1.0:
            distance += _STEP
        return distance

    def _is_good(self, pair, offset) -> bool:
        feet = self._nominal[pair[0]] + offset, self._nominal[pair[1]] - offset
        for leg, foot in zip(pair, feet, strict=True):
            if not in_leg_workspace(int(leg), *foot, self._chains, self._extension) or not self._carries(leg, foot):
                return False
        gap = leg_gap(int(pair[0]), feet[0], int(pair[1]), feet[1], self._chains, self._robot.leg_shapes)
        return gap >= self._robot.leg_clearance

    def _carries(self, leg, foot) -> bool:
        """Whether the motors hold half the weight at ``foot`` (3,) in B with their share of effort."""
        q = np.array(self._robot.nominal_joints)
        q[leg.joints], reached = self._robot.leg_inverse_kinematics_B(int(leg), foot)
        jacobian = self._robot.foot_jacobians_B(q)[leg]
        efforts = np.abs(jacobian[2]) * 0.5 * self._robot.mass * GRAVITY
        return reached and bool(np.all(efforts <= self._robot.effort_share * self._robot.effort_limits[leg.joints]))
