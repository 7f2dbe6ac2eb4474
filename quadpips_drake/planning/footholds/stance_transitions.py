"""From one stance to the next: which footholds a swinging leg may take, and which combinations make a good stance.

Of the constraints of QuadPiPS section VI-C these are reachability (eq. 15) and swing distance (eq. 18) as numba kernels,
with the cost of an edge; those of the stance itself are in ``stance_rules``.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.math.small_algebra import store
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_labels import foothold_units, label_cost
from quadpips_drake.planning.footholds.stance_rules import (
    REJECTIONS,
    distance_between,
    distance_to_support,
    legs_on_ground,
    refusal,
    stance_deviation,
    too_close,
)
from quadpips_drake.planning.nominal_pose import to_frame, write_base_pose_above
from quadpips_drake.planning.region_table import foothold_near
from quadpips_drake.robots.reachability import inside_superquadric

_TOO_CLOSE, _OUT_OF_BALANCE = REJECTIONS.index("feet too close together"), REJECTIONS.index("out of balance")
_SAME = 0.02  # candidates nearer to each other than this [m] are one
# Where the swinging legs aim: fractions of the preferred stride, and of the turn that the torso path asks for.
_AIMS = np.array([[0.0, 0.0], [0.0, 1.0], [0.5, 1.0], [1.0, 1.0], [1.5, 1.0]])


class Transitions(NamedTuple):
    """Room for what ``expand`` returns."""

    feet: np.ndarray
    normals: np.ndarray
    regions: np.ndarray
    p_WB: np.ndarray
    rpy_WB: np.ndarray
    costs: np.ndarray
    ways: np.ndarray
    by_labels: np.ndarray
    swings: np.ndarray
    refused: np.ndarray


def cost_rate(config: FootholdConfig) -> float:
    """Returns the least cost of moving the base by one metre: the distance itself and the swings at the preferred length.

    A swing of length d costs step_weight (1 + (d / preferred)^2) / 2 >= step_weight d / preferred, and moves the base by at
    most d / 4, whence the rate. It makes the cost-to-go a lower bound (but for its inflation).
    """
    return 1.0 + 4.0 * config.step_weight / config.preferred_swing


@njit(cache=True)
def distance_to_go(x, y, yaw, path, remaining, yaw_weight):
    """Returns the way from a pose to the end of ``path`` [m], turning included, and the pose of the path to head for first.

    min over the poses i of |pose - path_i| + remaining_i. Each term changes by no more than the pose moves, so the result
    does too: as a cost-to-go it is consistent, but unlike the straight line it leads round corners.

    Args:
        path: x, y, yaw along the torso path, (n, 3); the last one is the waypoint.
        remaining: way from each pose to the last one, (n,).
    """
    best, index = np.inf, 0
    for i in range(len(path)):
        way = np.hypot(path[i, 0] - x, path[i, 1] - y)
        if way + remaining[i] >= best:  # turning only adds to it
            continue
        way += yaw_weight * abs(wrap_angle(path[i, 2] - yaw))
        way += remaining[i]
        if way < best:
            best, index = way, i
    return best, index


@njit(cache=True)
def pose_of_stance_legs(feet, swinging, yaw, nominal):
    """Returns x, y, yaw of the base for which the feet that stay down would be at their nominal places.

    With two or more of them it is the least-squares fit of a rigid motion in the plane, else ``yaw`` is kept.
    """
    n = 0
    fx = fy = bx = by = 0.0
    for leg in range(4):
        if not swinging[leg]:
            n += 1
            fx, fy = fx + feet[leg, 0], fy + feet[leg, 1]
            bx, by = bx + nominal[leg, 0], by + nominal[leg, 1]
    fx, fy, bx, by = fx / n, fy / n, bx / n, by / n
    if n > 1:
        dot = cross = 0.0
        for leg in range(4):
            if not swinging[leg]:
                px, py = feet[leg, 0] - fx, feet[leg, 1] - fy
                qx, qy = nominal[leg, 0] - bx, nominal[leg, 1] - by
                dot += qx * px + qy * py
                cross += qx * py - qy * px
        yaw = np.arctan2(cross, dot)
    c, s = np.cos(yaw), np.sin(yaw)
    return fx - (c * bx - s * by), fy - (s * bx + c * by), yaw


@njit(cache=True)
def step_aims(feet, swinging, yaw, path, remaining, model):
    """Returns the poses (x, y, yaw), (5, 3), under which the swinging legs would like to stand next.

    The pose that belongs to the feet on the ground is carried along the torso path: by nothing, by half, one, and one and a
    half times the stride that goes with the preferred swing.
    """
    x, y, yaw = pose_of_stance_legs(feet, swinging, yaw, model.nominal)
    _, index = distance_to_go(x, y, yaw, path, remaining, model.yaw_weight)
    ahead = index  # head for a pose some way ahead, else the direction is that of the noise in the present one
    while ahead < len(path) - 1 and np.hypot(path[ahead, 0] - x, path[ahead, 1] - y) < 2.0 * model.preferred_swing:
        ahead += 1
    dx, dy = path[ahead, 0] - x, path[ahead, 1] - y
    distance = np.hypot(dx, dy)
    turn = wrap_angle(path[ahead, 2] - yaw)
    turn = min(max(turn, -model.max_yaw_step), model.max_yaw_step)
    aims = np.empty((len(_AIMS), 3))
    for k in range(len(_AIMS)):
        stride = min(_AIMS[k, 0] * 0.5 * model.preferred_swing, distance)
        scale = stride / distance if distance > 1e-9 else 0.0
        aims[k] = (x + scale * dx, y + scale * dy, yaw + _AIMS[k, 1] * turn)
    return aims


@njit(cache=True)
def _add_labels(points, normals, regions, scores, count, model, mask):
    """Returns the units of the labels of the first ``count`` footholds, and adds to their ``scores`` what these cost."""
    units = np.zeros(count)
    if mask.weight > 0.0:
        for i in range(count):
            units[i] = foothold_units(points, normals, regions, i, model.foot_radius, mask)
            scores[i] += mask.weight * units[i]
    return units


@njit(cache=True)
def leg_candidates(leg, foot, normal, region, aims, p_WB, R_WB, table, model, mask):
    """Returns the footholds that leg ``leg`` may swing to, best first.

    Args:
        foot, normal, region: ground point (3,), normal (3,) and region index of the foot now; it may come down there again.
        aims: poses (x, y, yaw) under which it would like to stand, (m, 3).
        p_WB, R_WB: nominal base of the present stance. mask: FootholdLabels.

    Returns:
        Points (k, 3), normals (k, 3), region indices (k,), units of their labels (k,), k <= candidates_per_leg. The order is
        by the distance between a foothold and the aim for which it was chosen, and by what its labels cost.
    """
    m, n = len(aims), len(table.origins)
    wanted = np.empty((m, 2))
    for a in range(m):
        c, s = np.cos(aims[a, 2]), np.sin(aims[a, 2])
        wanted[a, 0] = aims[a, 0] + c * model.nominal[leg, 0] - s * model.nominal[leg, 1]
        wanted[a, 1] = aims[a, 1] + s * model.nominal[leg, 0] + c * model.nominal[leg, 1]
    points, normals = np.empty((m * n + 1, 3)), np.empty((m * n + 1, 3))
    indices, scores = np.empty(m * n + 1, dtype=np.int64), np.empty(m * n + 1)

    store(points[0], foot)
    store(normals[0], normal)
    indices[0], scores[0] = region, np.inf
    for a in range(m):
        scores[0] = min(scores[0], np.hypot(wanted[a, 0] - foot[0], wanted[a, 1] - foot[1]))
    count = 1
    for k in range(n):
        center = table.origins[k]
        if np.hypot(center[0] - foot[0], center[1] - foot[1]) > table.radii[k] + model.max_swing:
            continue
        up_x, up_y, up_z = table.rotations[k, 0, 2], table.rotations[k, 1, 2], table.rotations[k, 2, 2]
        for a in range(m):
            if model.use_centers:
                x, y, z = center[0], center[1], center[2]
            else:
                x, y, z = foothold_near(table, k, wanted[a, 0], wanted[a, 1], model.inward_pull)
            score = np.hypot(wanted[a, 0] - x, wanted[a, 1] - y)
            swing = np.sqrt((x - foot[0]) ** 2 + (y - foot[1]) ** 2 + (z - foot[2]) ** 2)
            if swing > model.max_swing or abs(z - foot[2]) > model.max_rise:
                continue
            known = False
            for i in range(count):
                if abs(points[i, 0] - x) + abs(points[i, 1] - y) + abs(points[i, 2] - z) < _SAME:
                    scores[i] = min(scores[i], score)
                    known = True
                    break
            if known:
                continue
            r = model.foot_radius
            bx, by, bz = to_frame(R_WB, p_WB, x + r * up_x, y + r * up_y, z + r * up_z)
            if not inside_superquadric(bx, by, bz, model.reach_centers[leg], model.reach_semi_axes, model.reach_exponents):
                continue
            points[count, 0], points[count, 1], points[count, 2] = x, y, z
            normals[count, 0], normals[count, 1], normals[count, 2] = up_x, up_y, up_z
            indices[count], scores[count] = k, score
            count += 1
    units = _add_labels(points, normals, indices, scores, count, model, mask)
    order = np.argsort(scores[:count], kind="mergesort")[: model.candidates_per_leg]
    return points[order], normals[order], indices[order], units[order]


@njit(cache=True)
def edge_cost(feet, new_feet, swinging, p_WB, rpy_WB, new_p_WB, new_rpy_WB, model):
    """Returns the cost of a transition [m]: the way of the base and its turning, swings, stretched and twisted stances."""
    dx, dy, dz = new_p_WB[0] - p_WB[0], new_p_WB[1] - p_WB[1], new_p_WB[2] - p_WB[2]
    cost = np.sqrt(dx * dx + dy * dy + dz * dz) + model.yaw_weight * abs(wrap_angle(new_rpy_WB[2] - rpy_WB[2]))
    for leg in range(4):
        if swinging[leg]:
            swing = distance_between(new_feet, leg, feet, leg)
            cost += 0.5 * model.step_weight * (1.0 + (swing / model.preferred_swing) ** 2)
            cost += model.rise_weight * abs(new_feet[leg, 2] - feet[leg, 2])
    cost += model.stance_weight * stance_deviation(new_feet, new_p_WB, new_rpy_WB[2], model.nominal, model.stance_slack)
    twist = 0.5 * (new_feet[0, 2] + new_feet[3, 2] - new_feet[1, 2] - new_feet[2, 2])
    return cost + model.twist_weight * twist * twist


@njit(cache=True)
def _all_candidates(feet, normals, regions, swing_legs, aims, p_WB, R_WB, table, model, mask):
    """Returns ``leg_candidates`` of the first and of the last swinging leg.

    A single leg is both; then one stand-in is enough for the last, whose footholds are not looked at and cost nothing.
    """
    first, last = swing_legs[0], swing_legs[-1]
    points_a, normals_a, regions_a, units_a = leg_candidates(
        first, feet[first], normals[first], regions[first], aims, p_WB, R_WB, table, model, mask
    )
    if first == last:
        return points_a, normals_a, regions_a, units_a, points_a[:1], normals_a[:1], regions_a[:1], np.zeros(1)
    points_b, normals_b, regions_b, units_b = leg_candidates(
        last, feet[last], normals[last], regions[last], aims, p_WB, R_WB, table, model, mask
    )
    return points_a, normals_a, regions_a, units_a, points_b, normals_b, regions_b, units_b


@njit(cache=True)
def _units_of_standing(feet, normals, regions, swinging, model, mask):
    """Returns the units of the labels under the feet that stay down."""
    total = 0.0
    for leg in range(4):
        if not swinging[leg] and mask.weight > 0.0:
            total += foothold_units(feet, normals, regions, leg, model.foot_radius, mask)
    return total


@njit(cache=True)
def expand(feet, normals, regions, swings, p_WB, rpy_WB, path, remaining, table, model, mask):
    """Returns every permitted stance that one swing leads to.

    Args:
        feet, normals, regions: the present stance, (4, 3), (4, 3), (4,) indices into ``table``.
        swings: the swings to try: what they are called, and the first and the last of the one or two legs, int64 (n, 3).
        p_WB, rpy_WB: nominal base of the present stance.
        path, remaining: see ``distance_to_go``. mask: FootholdLabels.

    Returns:
        feet (k, 4, 3), normals (k, 4, 3), regions (k, 4), base positions (k, 3), rpy (k, 3), edge costs (k,), ways to go
        (k,), the part of the costs due to labels (k,), which swing (k,), swing after swing, and the number of refused
        combinations for each of REJECTIONS.
    """
    most = 0
    for swing in swings:
        most += model.candidates_per_leg * (model.candidates_per_leg if swing[1] != swing[2] else 1)
    found = Transitions(
        np.empty((most, 4, 3)), np.empty((most, 4, 3)), np.empty((most, 4), dtype=np.int64), np.empty((most, 3)),
        np.empty((most, 3)), np.empty(most), np.empty(most), np.empty(most), np.empty(most, dtype=np.int64),
        np.zeros(len(REJECTIONS), dtype=np.int64),
    )  # fmt: skip
    k = 0
    for swing in swings:
        k = _expand_one(feet, normals, regions, swing, p_WB, rpy_WB, path, remaining, table, model, mask, found, k)
    return (
        found.feet[:k], found.normals[:k], found.regions[:k], found.p_WB[:k], found.rpy_WB[:k], found.costs[:k],
        found.ways[:k], found.by_labels[:k], found.swings[:k], found.refused,
    )  # fmt: skip


@njit(cache=True)
def _expand_one(feet, normals, regions, swing, p_WB, rpy_WB, path, remaining, table, model, mask, found, k):
    """Writes what one of the ``swings`` leads to into ``found`` from row ``k`` on; returns the row after the last one."""
    name, first, last = swing[0], swing[1], swing[2]
    swinging = np.zeros(4, dtype=np.bool_)
    swinging[first] = swinging[last] = True
    aims = step_aims(feet, swinging, rpy_WB[2], path, remaining, model)
    points_a, normals_a, regions_a, units_a, points_b, normals_b, regions_b, units_b = _all_candidates(
        feet, normals, regions, swing[1:], aims, p_WB, rotation_from_rpy(rpy_WB), table, model, mask
    )
    standing, legs = _units_of_standing(feet, normals, regions, swinging, model, mask), legs_on_ground(swinging)
    close_a, close_b = (
        _too_close_to_standing(points_a, feet, legs, model),
        _too_close_to_standing(points_b, feet, legs, model),
    )
    waypoint_yaw = path[-1, 2]
    facing = np.cos(rpy_WB[2] - waypoint_yaw)
    # Room for one stance: allocated for each, it would cost as much as the tests.
    new_feet, new_normals, new_p, new_rpy = feet.copy(), normals.copy(), np.empty(3), np.empty(3)
    centers = np.empty((4, 3))
    for a in range(len(points_a)):
        for b in range(len(points_b)):
            if close_a[a] or (first != last and (close_b[b] or too_close(points_a, a, points_b, b, model))):
                found.refused[_TOO_CLOSE] += 1
                continue
            for i in range(3):  # a single leg is both: the stand-in for the last is overwritten
                new_feet[last, i], new_normals[last, i] = points_b[b, i], normals_b[b, i]
                new_feet[first, i], new_normals[first, i] = points_a[a, i], normals_a[a, i]
            write_base_pose_above(new_feet, model.base_height, model.max_tilt, new_p, new_rpy)
            why = refusal(new_feet, new_normals, new_p, new_rpy, facing, waypoint_yaw, model, centers)
            if why >= 0:
                found.refused[why] += 1
                continue
            aside = distance_to_support(feet, legs, 0.5 * (p_WB[0] + new_p[0]), 0.5 * (p_WB[1] + new_p[1]))
            if aside > model.max_support_distance:
                found.refused[_OUT_OF_BALANCE] += 1
                continue
            for leg in range(4):
                found.regions[k, leg] = regions[leg]
                for i in range(3):
                    found.feet[k, leg, i], found.normals[k, leg, i] = new_feet[leg, i], new_normals[leg, i]
            found.regions[k, last] = regions_b[b]
            found.regions[k, first] = regions_a[a]
            for i in range(3):
                found.p_WB[k, i], found.rpy_WB[k, i] = new_p[i], new_rpy[i]
            cost = edge_cost(feet, new_feet, swinging, p_WB, rpy_WB, new_p, new_rpy, model)
            cost += model.support_weight * aside * aside
            found.by_labels[k] = label_cost(standing + units_a[a] + units_b[b], mask)
            found.costs[k] = cost + found.by_labels[k]
            found.ways[k], _ = distance_to_go(new_p[0], new_p[1], new_rpy[2], path, remaining, model.yaw_weight)
            found.swings[k] = name
            k += 1
    return k


@njit(cache=True)
def _too_close_to_standing(points, feet, legs, model):
    """Whether a foot at each of ``points`` (n, 3) is too close to one of the standing ``legs``, or these to each other."""
    close = np.zeros(len(points), dtype=np.bool_)
    for i in range(len(legs)):
        for j in range(i):
            if too_close(feet, legs[i], feet, legs[j], model):
                close[:] = True
        for k in range(len(points)):
            close[k] = close[k] or too_close(points, k, feet, legs[i], model)
    return close
