"""Where a foot comes down that wants to go somewhere: the projection onto the best region.

A region costs the squared distance of its nearest foothold to the wanted one, plus a penalty on what the leg cannot do well
from the hips at touch-down and at the next lift-off: stepping in below the body, and stretching too far (the perceptive
example of OCS2: Grandia et al., IEEE T-RO 2023).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.planning.nominal_pose import base_pose_above, to_frame
from quadpips_drake.planning.region_table import nearest_in_polygon
from quadpips_drake.robots.reachability import LegChains, leg_chains


class LegPenalty(NamedTuple):
    """What the penalty needs to know of the robot; a NamedTuple, so that numba takes it as it is."""

    chains: LegChains
    sides: np.ndarray
    """1 for legs on the left of the body, -1 for those on its right, (4,)."""
    max_extension: float
    """Longest leg that costs nothing, from HFE to foot, as part of the straight one [1]."""
    weight: float
    """Factor on the penalty [1]."""
    foot_radius: float
    """[m]"""


def leg_penalty(robot, max_extension: float, weight: float) -> LegPenalty:
    """Returns the ``LegPenalty`` of a RobotModel."""
    sides = np.sign(robot.nominal_footholds_B[:, 1])
    return LegPenalty(leg_chains(robot), sides, float(max_extension), float(weight), float(robot.foot_radius))


@njit(cache=True)
def kinematic_penalty(leg, x, y, z, origins, rotations, legs):
    """Returns instep^2 + over-extension^2 [m^2] of ``leg`` with its foot centre at (x, y, z), over all base poses.

    Args:
        origins, rotations: base poses in W, (n, 3) and (n, 3, 3).
        legs: LegPenalty.
    """
    offsets = legs.chains.offsets[leg]
    haa, thigh, knee, foot = offsets[0], offsets[1], offsets[2], offsets[3]
    lateral = thigh[1] + knee[1] + foot[1]
    longest = legs.max_extension * (legs.chains.links[leg, 0] + legs.chains.links[leg, 1])
    total = 0.0
    for i in range(len(origins)):
        px, py, pz = to_frame(rotations[i], origins[i], x, y, z)
        px, py, pz = px - haa[0] - thigh[0], py - haa[1], pz - haa[2]
        instep = max(0.0, -legs.sides[leg] * py)
        # In the leg's plane, as far below its HFE as the hip joint can turn it.
        below = np.sqrt(max(0.0, py * py + pz * pz - lateral * lateral)) + thigh[2]
        stretch = max(0.0, np.sqrt(px * px + below * below) - longest)
        total += instep * instep + stretch * stretch
    return total


@njit(cache=True)
def best_foothold(table, leg, point, origins, rotations, legs, reach):
    """Returns the index of the best region for the ground point ``point`` (3,) in W, and the foothold on it: k, x, y, z.

    k is -1 if no region comes as near as ``reach`` [m]. The foothold is the point of the inset polygon nearest in space.

    Args:
        table: RegionTable.
        leg: whose foot it is.
        origins, rotations: base poses at touch-down and at the next lift-off, (n, 3) and (n, 3, 3); none: no penalty.
        legs: LegPenalty.
    """
    best, found = np.inf, -1
    best_x = best_y = best_z = 0.0
    for k in range(len(table.origins)):
        origin, R = table.origins[k], table.rotations[k]
        u, v, w = to_frame(R, origin, point[0], point[1], point[2])
        least = max(0.0, np.sqrt(u * u + v * v + w * w) - table.radii[k])
        if least > reach or least * least >= best:
            continue
        near_u, near_v, _ = nearest_in_polygon(u, v, table.insets[k], table.counts[k])
        cost = (near_u - u) ** 2 + (near_v - v) ** 2 + w * w
        if cost > reach * reach or cost >= best:
            continue
        x = origin[0] + R[0, 0] * near_u + R[0, 1] * near_v
        y = origin[1] + R[1, 0] * near_u + R[1, 1] * near_v
        z = origin[2] + R[2, 0] * near_u + R[2, 1] * near_v
        if len(origins):
            r = legs.foot_radius
            foot_x, foot_y, foot_z = x + r * R[0, 2], y + r * R[1, 2], z + r * R[2, 2]
            cost += legs.weight * kinematic_penalty(leg, foot_x, foot_y, foot_z, origins, rotations, legs)
        if cost < best:
            best, found, best_x, best_y, best_z = cost, k, x, y, z
    return found, best_x, best_y, best_z


@njit(cache=True)
def bases_over_regions(table, poses, nominal, plane, legs, reach, height, max_tilt):
    """Returns height [m], roll and pitch [rad] of a base over the regions under its nominal feet, for each pose, (n, 3).

    Args:
        table: RegionTable.
        poses: x, y [m], yaw [rad] in W, (n, 3).
        nominal: nominal footholds in the base's heading frame, x, y [m], (4, 2).
        plane: about which regions are looked for, and where the ground is if none is as near as ``reach`` [m]: x, y of a
            point, height there [m], slopes dz/dx and dz/dy, (5,).
        legs: LegPenalty; only its shape matters.
        height: of the base above level ground [m].
        max_tilt: [rad]
    """
    result, feet, point = np.empty((len(poses), 3)), np.empty((4, 3)), np.empty(3)
    no_origins, no_rotations = np.empty((0, 3)), np.empty((0, 3, 3))
    for i in range(len(poses)):
        c, s = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        for leg in range(4):
            point[0] = poses[i, 0] + c * nominal[leg, 0] - s * nominal[leg, 1]
            point[1] = poses[i, 1] + s * nominal[leg, 0] + c * nominal[leg, 1]
            point[2] = plane[2] + plane[3] * (point[0] - plane[0]) + plane[4] * (point[1] - plane[1])
            k, _, _, z = best_foothold(table, leg, point, no_origins, no_rotations, legs, reach)
            feet[leg, 0], feet[leg, 1], feet[leg, 2] = point[0], point[1], z if k >= 0 else point[2]
        center, rpy = base_pose_above(feet, height, max_tilt)
        result[i, 0], result[i, 1], result[i, 2] = center[2], rpy[0], rpy[1]
    return result
