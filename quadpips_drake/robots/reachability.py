"""What a leg can reach: superquadric volumes (QuadPiPS eq. 15) and the exact workspace by inverse kinematics.

The kernels are numba functions on plain arrays, so that a search can test thousands of footholds per millisecond.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.values.legs import JOINTS_PER_LEG, NUM_LEGS

_TURN = 2.0 * np.pi


class LegChains(NamedTuple):
    """Geometry and limits of the four legs; a NamedTuple, so that numba takes it as it is."""

    offsets: np.ndarray
    """Origins of HAA in B, HFE in the hip, KFE in the thigh, and the foot centre in the shank [m], (4, 4, 3)."""
    lower: np.ndarray
    """Joint limits [rad], (4, 3)."""
    upper: np.ndarray
    links: np.ndarray
    """Of thigh and shank in the leg's plane: their lengths [m], how far they point from +z towards +x at zero [rad], and
    -1 or 1 for the side to which the knee bends in the nominal stance, (4, 5)."""


def leg_chains(robot) -> LegChains:
    """Collects the ``LegChains`` of a RobotModel."""
    shape = (NUM_LEGS, JOINTS_PER_LEG)
    joint_offsets = np.asarray(robot.tree.joint_offset, dtype=float).reshape(*shape, 3)
    feet = np.asarray(robot.tree.foot_offset, dtype=float).reshape(NUM_LEGS, 1, 3)
    knee, foot = joint_offsets[:, 2], feet[:, 0]
    zeros = np.arctan2(knee[:, 0], knee[:, 2]), np.arctan2(foot[:, 0], foot[:, 2])
    nominal = np.array(robot.nominal_joints, dtype=float).reshape(shape)
    side = np.where(np.sin(nominal[:, 2] + zeros[1] - zeros[0]) < 0.0, -1.0, 1.0)
    lengths = np.hypot(knee[:, 0], knee[:, 2]), np.hypot(foot[:, 0], foot[:, 2])
    return LegChains(
        offsets=np.concatenate([joint_offsets, feet], axis=1),
        lower=np.array(robot.position_limits_lower, dtype=float).reshape(shape),
        upper=np.array(robot.position_limits_upper, dtype=float).reshape(shape),
        links=np.column_stack((*lengths, *zeros, side)),
    )


@njit(cache=True)
def inside_superquadric(x, y, z, center, semi_axes, exponents):
    """Whether the point (x, y, z) lies in the superquadric of eq. 15: sum_i |(p_i - center_i) / a_i|^e_i <= 1."""
    value = abs((x - center[0]) / semi_axes[0]) ** exponents[0]
    value += abs((y - center[1]) / semi_axes[1]) ** exponents[1]
    value += abs((z - center[2]) / semi_axes[2]) ** exponents[2]
    return value <= 1.0


@njit(cache=True)
def _within(angle, lower, upper):
    """Whether ``angle``, or the same angle a full turn away, lies in [lower, upper]."""
    return (lower <= angle <= upper) or (lower <= angle - _TURN <= upper) or (lower <= angle + _TURN <= upper)


@njit(cache=True)
def in_leg_workspace(leg, x, y, z, chains, max_extension):
    """Whether leg ``leg`` reaches the foot centre (x, y, z) in B [m] within its joint limits, on its nominal knee branch.

    ``max_extension`` bounds the distance from HFE to foot in the leg's plane, as a fraction of the straight leg's: a leg
    that is nearly straight can neither follow the base nor push.

    The same geometry as ``solve_leg``, which returns angles and prefers solutions near a guess; this one only answers
    yes or no, and 15 times faster, for it is asked some hundred thousand times in a search.
    """
    haa, thigh, knee, foot = chains.offsets[leg, 0], chains.offsets[leg, 1], chains.offsets[leg, 2], chains.offsets[leg, 3]
    lateral = thigh[1] + knee[1] + foot[1]
    y, z = y - haa[1], z - haa[2]
    below = y * y + z * z - lateral * lateral
    if below <= 0.0:
        return False
    below = -np.sqrt(below)

    # In the leg's plane: two links. Directions are measured from +z towards +x, so that a rotation about y adds to them.
    x, down = x - haa[0] - thigh[0], below - thigh[2]
    links, reach = chains.links[leg], np.hypot(x, down)
    l1, l2, zero1, zero2 = links[0], links[1], links[2], links[3]
    if reach > max_extension * (l1 + l2) or reach < abs(l1 - l2):
        return False
    if not _within(np.arctan2(z, y) - np.arctan2(below, lateral), chains.lower[leg, 0], chains.upper[leg, 0]):
        return False
    bend = links[4] * np.arccos((reach * reach - l1 * l1 - l2 * l2) / (2.0 * l1 * l2))
    if not _within(bend + zero1 - zero2, chains.lower[leg, 2], chains.upper[leg, 2]):
        return False
    hip = np.arctan2(x, down) - zero1 - np.arctan2(l2 * np.sin(bend), l1 + l2 * np.cos(bend))
    return _within(hip, chains.lower[leg, 1], chains.upper[leg, 1])
