"""Which stances are permitted: distinct footholds, stance stability, forward facing, reach, legs apart, balance; and which
are of one family.

The constraints of QuadPiPS section VI-C (eqs. 16-17) as numba kernels, and what they need to know of robot and settings.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.nominal_pose import to_frame
from quadpips_drake.robots.leg_shapes import LegShapes, are_nearer, place_capsules
from quadpips_drake.robots.reachability import LegChains, in_leg_workspace, leg_chains
from quadpips_drake.robots.stance_limits import StanceLimits, stance_limits
from quadpips_drake.values.legs import Leg

REJECTIONS = (
    "feet too close together",
    "stance stability",
    "facing backward",
    "out of a leg's workspace",
    "legs too close together",
    "out of balance",
    "ground in the way of a foot",
    "something in the way of the torso",
)
"""Why a combination of footholds is refused, in the order of the tests."""
BLOCKED, NO_ROOM = len(REJECTIONS) - 2, len(REJECTIONS) - 1
"""The last ones, which are looked at only when it is a stance's turn."""

_USUAL = 0.9  # feet at least this fraction of their nominal distance apart: the legs do not touch


_CELL = 0.02
"""Footholds of the same leg in the same cell of this size [m] count as one in the identity of a node."""


class TransitionModel(NamedTuple):
    """Robot and settings as the kernels need them."""

    chains: LegChains
    shapes: LegShapes
    limits: StanceLimits
    foot_radius: float
    base_height: float
    nominal: np.ndarray
    """Nominal ground points under the base, in the frame of its yaw [m], (4, 2)."""
    reach_centers: np.ndarray
    """Centres of the superquadrics in B [m], (4, 3)."""
    reach_semi_axes: np.ndarray
    reach_exponents: np.ndarray
    use_centers: bool
    candidates_per_leg: int
    inward_pull: float
    leg_clearance: float
    max_extension: float
    max_swing: float
    max_rise: float
    length_tolerance: float
    max_support_distance: float
    max_tilt: float
    max_yaw_step: float
    preferred_swing: float
    yaw_weight: float
    step_weight: float
    stance_weight: float
    stance_slack: float
    support_weight: float
    twist_weight: float
    rise_weight: float


def make_transition_model(robot, config: FootholdConfig) -> TransitionModel:
    """Collects what the kernels need of a RobotModel and the configuration."""
    feet = np.asarray(robot.nominal_footholds_B, dtype=float)
    outward = np.array([[1.0, leg.side, 1.0] for leg in Leg])
    copied = {name: getattr(config, name) for name in TransitionModel._fields if hasattr(config, name)}
    copied["reach_semi_axes"] = np.array(config.reach_semi_axes, dtype=float)
    copied["reach_exponents"] = np.array(config.reach_exponents, dtype=float)
    copied = {
        name: float(value) if isinstance(value, int) and name != "candidates_per_leg" else value
        for name, value in copied.items()
    }  # numba compiles once for each combination of types
    return TransitionModel(
        chains=leg_chains(robot),
        shapes=robot.leg_shapes,
        limits=stance_limits(robot, float(config.max_extension)),
        foot_radius=float(robot.foot_radius),
        base_height=float(robot.nominal_base_height),
        nominal=np.ascontiguousarray(feet[:, :2]),
        reach_centers=feet + outward * np.array(config.reach_offset, dtype=float),
        leg_clearance=float(robot.leg_clearance),
        use_centers=config.candidate == "center",
        **copied,
    )


@njit(cache=True)
def stance_deviation(feet, p_WB, yaw, nominal, slack):
    """Returns the sum over the legs of the squared distance between a foot and its nominal place under the base [m^2].

    Forward and backward the first ``slack`` [m] are free: in mid-walk one pair of feet is always ahead of the other.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    total = 0.0
    for leg in range(4):
        dx, dy = feet[leg, 0] - p_WB[0], feet[leg, 1] - p_WB[1]
        ahead = max(0.0, abs(c * dx + s * dy - nominal[leg, 0]) - slack)
        aside = -s * dx + c * dy - nominal[leg, 1]
        total += ahead * ahead + aside * aside
    return total


@njit(cache=True)
def distance_between(a, i, b, j):
    """Distance between row i of ``a`` and row j of ``b``, both (n, 3)."""
    return np.sqrt((a[i, 0] - b[j, 0]) ** 2 + (a[i, 1] - b[j, 1]) ** 2 + (a[i, 2] - b[j, 2]) ** 2)


@njit(cache=True)
def _is_stable(feet, p_WB, R_WB, model):
    """Stance stability, eqs. 16-17: widths and lengths of the stance in the base frame, within what the robot can do.

    Lengths are besides bounded about the nominal one, as in the paper.
    """
    nominal, limits = model.nominal, model.limits
    for left in (0, 2):
        _, y_left, _ = to_frame(R_WB, p_WB, feet[left, 0], feet[left, 1], feet[left, 2])
        _, y_right, _ = to_frame(R_WB, p_WB, feet[left + 1, 0], feet[left + 1, 1], feet[left + 1, 2])
        if not limits.min_width <= y_left - y_right <= limits.max_width:
            return False
    for fore in (0, 1):
        x_fore, _, _ = to_frame(R_WB, p_WB, feet[fore, 0], feet[fore, 1], feet[fore, 2])
        x_hind, _, _ = to_frame(R_WB, p_WB, feet[fore + 2, 0], feet[fore + 2, 1], feet[fore + 2, 2])
        length, ideal = x_fore - x_hind, nominal[fore, 0] - nominal[fore + 2, 0]
        if abs(length - ideal) >= model.length_tolerance or not limits.min_length <= length <= limits.max_length:
            return False
    return True


@njit(cache=True)
def _legs_touch(centers, model):
    """Whether neighbouring legs with their feet at ``centers`` (4, 3) in B are nearer than ``leg_clearance``.

    Pairs whose feet are about as far apart as in the nominal stance are not looked at.
    """
    n = len(model.shapes.radii[0])
    capsules, is_placed = np.empty((4, n, 2, 3)), np.zeros(4, dtype=np.bool_)
    for i, j in ((0, 1), (2, 3), (0, 2), (1, 3)):
        ideal = np.hypot(model.nominal[i, 0] - model.nominal[j, 0], model.nominal[i, 1] - model.nominal[j, 1])
        near = _USUAL * ideal
        dx, dy = centers[i, 0] - centers[j, 0], centers[i, 1] - centers[j, 1]
        if dx * dx + dy * dy >= near * near:
            continue
        for leg in (i, j):
            if not is_placed[leg]:
                x, y, z = centers[leg, 0], centers[leg, 1], centers[leg, 2]
                place_capsules(leg, x, y, z, model.chains, model.shapes, capsules[leg])
                is_placed[leg] = True
        if are_nearer(i, capsules[i], j, capsules[j], model.shapes, model.leg_clearance):
            return True
    return False


@njit(cache=True)
def too_close(a, i, b, j, model):
    """Whether two feet, row i of ``a`` and row j of ``b``, (n, 3), are too close together: the first of REJECTIONS."""
    return distance_between(a, i, b, j) < 2.0 * model.foot_radius + model.leg_clearance


@njit(cache=True)
def refusal(feet, normals, p_WB, rpy_WB, facing, waypoint_yaw, model, centers):
    """Returns -1 for a permitted stance, else the index in REJECTIONS of the first constraint that it breaks, feet that are
    ``too_close`` apart.

    ``facing`` is the cosine between the yaw before and the waypoint's: a robot that has to turn round may face backward
    as long as it does not turn further away (the paper demands facing forward outright). ``centers`` (4, 3) is room for
    the feet in B: allocated for every stance, it would cost as much as the tests.
    """
    r = model.foot_radius
    R_WB = rotation_from_rpy(rpy_WB)
    if not _is_stable(feet, p_WB, R_WB, model):
        return 1
    cosine = np.cos(rpy_WB[2] - waypoint_yaw)
    if cosine <= 0.0 and cosine < facing - 1e-9:
        return 2
    for leg in range(4):
        x, y, z = to_frame(
            R_WB,
            p_WB,
            feet[leg, 0] + r * normals[leg, 0],
            feet[leg, 1] + r * normals[leg, 1],
            feet[leg, 2] + r * normals[leg, 2],
        )
        if not in_leg_workspace(leg, x, y, z, model.chains, model.max_extension):
            return 3
        centers[leg, 0], centers[leg, 1], centers[leg, 2] = x, y, z
    if _legs_touch(centers, model):
        return 4
    return -1


@njit(cache=True)
def support_distance(feet, swinging, x, y):
    """Returns the horizontal distance [m] from (x, y) to the segment or triangle of the feet that stay on the ground.

    It is what makes a robot fall during a swing: an inverted pendulum of height h, at rest d beside its support, is
    d (cosh(t sqrt(g / h)) - 1) further away after the time t, that is almost 2 d after 0.4 s at h = 0.6 m.
    """
    return distance_to_support(feet, legs_on_ground(swinging), x, y)


@njit(cache=True)
def legs_on_ground(swinging):
    """Returns the legs that do not swing in clockwise order, int64 (n,)."""
    legs = np.empty(4, dtype=np.int64)
    n = 0
    for leg in (0, 1, 3, 2):
        if not swinging[leg]:
            legs[n] = leg
            n += 1
    return legs[:n]


@njit(cache=True)
def distance_to_support(feet, legs, x, y):
    """``support_distance`` for the ``legs_on_ground``."""
    n = len(legs)
    nearest = np.inf
    inside = n > 2
    for i in range(n):
        a, b = legs[i], legs[(i + 1) % n]
        ex, ey = feet[b, 0] - feet[a, 0], feet[b, 1] - feet[a, 1]
        px, py = x - feet[a, 0], y - feet[a, 1]
        t = min(1.0, max(0.0, (px * ex + py * ey) / max(ex * ex + ey * ey, 1e-12)))
        nearest = min(nearest, np.hypot(px - t * ex, py - t * ey))
        inside = inside and ex * py - ey * px <= 0.0  # the feet are in clockwise order
    return 0.0 if inside else nearest


@njit(cache=True, nogil=True)
def identities(rows, feet, regions, phase, standing, radii, single_place):
    """Returns the identities of the families of some stances before a ``phase``, int64 (m, 1 + 4 len(standing)).

    The phase, and region and place of each leg that stays down in it. Regions up to ``single_place`` in size are one place:
    on small stones centimetres make no other way, and a search that tells them apart comes to its bound before it has tried
    the stones.

    Args:
        rows: which of the stances, int64 (m,).
        feet, regions: of all stances, (k, 4, 3) [m] and (k, 4).
        phase, standing: the phase and the legs that stay down, int64 (n,).
        radii: of the regions [m].
    """
    n = len(standing)
    found = np.zeros((len(rows), 1 + 4 * n), dtype=np.int64)
    for i in range(len(rows)):
        k = rows[i]
        found[i, 0] = phase
        for j in range(n):
            region = regions[k, standing[j]]
            found[i, 1 + j] = region
            if radii[region] > single_place:
                for axis in range(3):
                    found[i, 1 + n + 3 * j + axis] = int(np.floor(feet[k, standing[j], axis] / _CELL))
    return found


@njit(cache=True, nogil=True)
def arrivals(rows, feet, p_WB, rpy_WB, waypoint, tolerance, yaw_tolerance, nominal):
    """Returns whether the base of some stances is at the waypoint (x, y, yaw), bool (m,), and how far their feet are from
    their nominal places, see ``stance_deviation``, (m,).

    Args:
        rows: which of the stances, int64 (m,).
        feet, p_WB, rpy_WB: of all stances, (k, 4, 3), (k, 3), (k, 3).
        tolerance, yaw_tolerance: of the base [m] and [rad].
        nominal: see ``TransitionModel``.
    """
    arrive, deviations = np.zeros(len(rows), dtype=np.bool_), np.empty(len(rows))
    for i in range(len(rows)):
        k = rows[i]
        if np.hypot(p_WB[k, 0] - waypoint[0], p_WB[k, 1] - waypoint[1]) <= tolerance:
            arrive[i] = abs(wrap_angle(rpy_WB[k, 2] - waypoint[2])) <= yaw_tolerance
        deviations[i] = stance_deviation(feet[k], p_WB[k], rpy_WB[k, 2], nominal, 0.0)
    return arrive, deviations
