"""What a leg can reach: superquadric volumes (QuadPiPS eq. 15) and the exact workspace by inverse kinematics.

The kernels are numba functions on plain arrays, so that a search can test thousands of footholds per millisecond.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.robots.leg_inverse_kinematics import solve_leg
from quadpips_drake.robots.legs import JOINTS_PER_LEG, NUM_LEGS

_LIMIT_TOLERANCE = 1e-6


class LegChains(NamedTuple):
    """Geometry and limits of the four legs; a NamedTuple, so that numba takes it as it is."""

    offsets: np.ndarray
    """Origins of HAA in B, HFE in the HAA frame, KFE in the HFE frame and the foot centre in the KFE frame [m], (4, 4, 3)."""
    lower: np.ndarray
    """Joint limits [rad], (4, 3)."""
    upper: np.ndarray
    nominal: np.ndarray
    """Nominal joint angles [rad], (4, 3)."""


def leg_chains(robot) -> LegChains:
    """Collects the ``LegChains`` of a RobotModel."""
    shape = (NUM_LEGS, JOINTS_PER_LEG)
    joint_offsets = np.asarray(robot.tree.joint_offset, dtype=float).reshape(*shape, 3)
    feet = np.asarray(robot.tree.foot_offset, dtype=float).reshape(NUM_LEGS, 1, 3)
    return LegChains(
        offsets=np.concatenate([joint_offsets, feet], axis=1),
        lower=np.array(robot.position_limits_lower, dtype=float).reshape(shape),
        upper=np.array(robot.position_limits_upper, dtype=float).reshape(shape),
        nominal=np.array(robot.nominal_joints, dtype=float).reshape(shape),
    )


@njit(cache=True)
def inside_superquadric(p, center, semi_axes, exponents):
    """Whether the point ``p`` (3,) lies in the superquadric of eq. 15: sum_i |(p_i - center_i) / a_i|^e_i <= 1."""
    value = 0.0
    for i in range(3):
        value += abs((p[i] - center[i]) / semi_axes[i]) ** exponents[i]
    return value <= 1.0


@njit(cache=True)
def in_leg_workspace(leg, p_BF, chains, max_extension):
    """Whether leg ``leg`` reaches the foot centre ``p_BF`` (3,) within its joint limits, on its nominal knee branch.

    ``max_extension`` bounds the distance from HFE to foot in the leg's plane, as a fraction of the straight leg's: a leg that
    is nearly straight can neither follow the base nor push.
    """
    haa, thigh, knee, foot = chains.offsets[leg]
    p_HF = p_BF - haa
    lateral = thigh[1] + knee[1] + foot[1]
    below = np.sqrt(max(p_HF[1] ** 2 + p_HF[2] ** 2 - lateral**2, 0.0))
    extension = np.hypot(p_HF[0] - thigh[0], below + thigh[2])
    if extension > max_extension * (np.hypot(knee[0], knee[2]) + np.hypot(foot[0], foot[2])):
        return False
    q, reached = solve_leg(
        p_HF, thigh, knee, foot, chains.lower[leg], chains.upper[leg], chains.nominal[leg], _LIMIT_TOLERANCE
    )
    return reached and q[2] * chains.nominal[leg, 2] > 0.0
