"""Analytic inverse kinematics of one leg: hip about x (HAA), two parallel joints about y (HFE, KFE)."""

import numpy as np
from numba import njit

from quadpips_drake.math.rotations import rotation_from_rpy

_TWO_PI = 2.0 * np.pi


@njit(cache=True)
def _closest_turn(angle, reference):
    """Returns ``angle`` + 2 pi k, the one closest to ``reference``."""
    return angle + _TWO_PI * np.round((reference - angle) / _TWO_PI)


@njit(cache=True)
def _within(q, lower, upper, tolerance):
    inside = True
    for i in range(3):
        inside = inside and lower[i] - tolerance <= q[i] <= upper[i] + tolerance
    return inside


@njit(cache=True)
def solve_leg(p_HF, thigh_offset, knee_offset, foot_offset, lower, upper, guess, tolerance):
    """Finds the joint angles that put the foot at ``p_HF``.

    The two parallel joints move the foot in a plane whose distance from the HAA's x axis is the sum ``d`` of the lateral
    offsets of the chain, whatever their angles. So the foot's (y, z) as seen from the HAA fixes HAA up to the mirror image
    in which the leg points up; in that plane there remains a triangle of hip, knee and foot with sides l1 and l2 = the
    lengths of the (x, z) parts of ``knee_offset`` and ``foot_offset``, whose knee may bend two ways. The offsets' own
    directions, which turn ANYmal's foot 15 degrees away from its knee's zero, enter as constant angles.

    Of the up to four solutions, the one within the joint limits that is closest to ``guess`` is returned. Where none is, the
    result is the closest of all, clamped to the limits; out of reach, the leg is stretched (or folded) towards the foot.

    Args:
        p_HF: wanted foot point, seen from the HAA's origin, in base axes [m], (3,).
        thigh_offset, knee_offset, foot_offset: origin of HFE in the hip's frame, of KFE in the thigh's, F in the shank's.
        lower, upper: joint limits [rad], (3,).
        guess: angles to stay close to [rad], (3,).
        tolerance: by how much limits may be exceeded [rad].

    Returns:
        The angles (3,) and whether they reach the foot within the limits.
    """
    d = thigh_offset[1] + knee_offset[1] + foot_offset[1]
    l1 = np.hypot(knee_offset[0], knee_offset[2])
    l2 = np.hypot(foot_offset[0], foot_offset[2])
    zero1 = np.arctan2(-knee_offset[0], -knee_offset[2])
    zero2 = np.arctan2(-foot_offset[0], -foot_offset[2])

    radial = p_HF[1] * p_HF[1] + p_HF[2] * p_HF[2] - d * d
    reached = radial >= 0.0
    depth = np.sqrt(max(radial, 0.0))

    best = guess.copy()
    best_distance = np.inf
    best_inside = False
    for upright in range(2):
        h = -depth if upright == 0 else depth
        haa = _closest_turn(np.arctan2(p_HF[2], p_HF[1]) - np.arctan2(h, d), guess[0])
        x = p_HF[0] - thigh_offset[0]
        z = h - thigh_offset[2]
        # Angles of a link about y are measured from straight down; turning by a moves it to (-sin a, -cos a) in (x, z).
        cosine = (x * x + z * z - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        in_reach = -1.0 <= cosine <= 1.0
        knee_bend = np.arccos(min(1.0, max(-1.0, cosine)))
        for mirror in range(2):
            bend = knee_bend if mirror == 0 else -knee_bend
            thigh = np.arctan2(-x, -z) - np.arctan2(l2 * np.sin(bend), l1 + l2 * np.cos(bend))
            q = np.empty(3)
            q[0] = haa
            q[1] = _closest_turn(thigh - zero1, guess[1])
            q[2] = _closest_turn(bend + zero1 - zero2, guess[2])
            inside = in_reach and _within(q, lower, upper, tolerance)
            distance = max(abs(q[0] - guess[0]), abs(q[1] - guess[1]), abs(q[2] - guess[2]))
            if (inside and not best_inside) or (inside == best_inside and distance < best_distance):
                best, best_distance, best_inside = q, distance, inside
    for i in range(3):
        best[i] = min(max(best[i], lower[i]), upper[i])
    return best, reached and best_inside


@njit(cache=True, nogil=True)
def follow_feet(joint_offset, foot_offset, lower, upper, tolerance, p_WB, rpy_WB, p_WF, guess, joints, reached):
    """Joint angles of all legs along a motion of base and feet, each close to those before.

    Args:
        joint_offset, foot_offset: of the KinematicTree.
        lower, upper: joint limits [rad], (12,).
        tolerance: by how much limits may be exceeded [rad].
        p_WB, rpy_WB: base poses [m, rad], (n, 3) each.
        p_WF: foot centres in W [m], (n, 4, 3).
        guess: angles to begin close to, (12,).
        joints, reached: are filled: angles (n, 12) and whether each foot is where it should be, (n, 4).
    """
    p_HF, last = np.empty(3), guess.copy()
    for k in range(len(joints)):
        rotation = rotation_from_rpy(rpy_WB[k])
        for leg in range(4):
            first = 3 * leg
            for i in range(3):
                p_HF[i] = -joint_offset[first, i]
                for j in range(3):
                    p_HF[i] += rotation[j, i] * (p_WF[k, leg, j] - p_WB[k, j])
            angles, reached[k, leg] = solve_leg(
                p_HF,
                joint_offset[first + 1],
                joint_offset[first + 2],
                foot_offset[leg],
                lower[first : first + 3],
                upper[first : first + 3],
                last[first : first + 3],
                tolerance,
            )
            for i in range(3):
                joints[k, first + i] = angles[i]
                last[first + i] = angles[i]
