"""The collision shapes of thighs and shanks as capsules, and how near two legs are to each other.

Drake's proximity engine answers the same question exactly, but a search asks it thousands of times in a few milliseconds;
``tests/robots/test_leg_shapes.py`` holds one against the other.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from pydrake.geometry import Box, Capsule, Cylinder, Role, Sphere

from quadpips_drake.values.legs import NUM_LEGS, Leg

_LINKS = ("THIGH", "SHANK")
_ROUNDING = 1e-9
"""Much more than the rounding of a distance [m]."""


class LegShapes(NamedTuple):
    """Capsules of the four legs; a NamedTuple, so that numba takes it as it is."""

    links: np.ndarray
    """0 for a capsule of the thigh, 1 for one of the shank, int64 (4, n)."""
    ends: np.ndarray
    """Both ends of their axes in the link's frame [m], (4, n, 2, 3)."""
    radii: np.ndarray
    """[m], (4, n); negative for a place that is not used."""


def _as_capsule(shape) -> tuple[np.ndarray, float] | None:
    """Returns half the axis (3,) and the radius of a capsule like ``shape``; a box is as thick as its middle edge."""
    if isinstance(shape, Sphere):
        return np.zeros(3), shape.radius()
    if isinstance(shape, Capsule):
        return np.array([0.0, 0.0, 0.5 * shape.length()]), shape.radius()
    if isinstance(shape, Cylinder):
        return np.array([0.0, 0.0, max(0.5 * shape.length() - shape.radius(), 0.0)]), shape.radius()
    if isinstance(shape, Box):
        size = np.array(shape.size())
        order = np.argsort(size, kind="stable")
        radius, axis = 0.5 * float(size[order[1]]), np.zeros(3)
        axis[order[2]] = max(0.5 * float(size[order[2]]) - radius, 0.0)
        return axis, radius
    return None


def read_leg_shapes(plant, scene_graph) -> LegShapes:
    """Reads the shapes with a proximity role out of a plant; what is no sphere, capsule, cylinder or box does not count."""
    inspector = scene_graph.model_inspector()
    found = []
    for leg in Leg:
        capsules = []
        for link, name in enumerate(_LINKS):
            frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(f"{leg.name}_{name}").index())
            geometries = sorted(inspector.GetGeometries(frame, Role.kProximity), key=inspector.GetName)
            for geometry in geometries:
                capsule = _as_capsule(inspector.GetShape(geometry))
                if capsule is not None:
                    X_LG = inspector.GetPoseInFrame(geometry)
                    half = X_LG.rotation().matrix() @ capsule[0]
                    ends = np.array([X_LG.translation() - half, X_LG.translation() + half])
                    capsules.append((link, ends, capsule[1]))
        found.append(capsules)
    most = max(len(capsules) for capsules in found)
    links, ends = np.zeros((NUM_LEGS, most), dtype=np.int64), np.zeros((NUM_LEGS, most, 2, 3))
    radii = np.full((NUM_LEGS, most), -1.0)
    for leg, capsules in enumerate(found):
        for k, (link, both_ends, radius) in enumerate(capsules):
            links[leg, k], ends[leg, k], radii[leg, k] = link, both_ends, radius
    for array in (links, ends, radii):
        array.flags.writeable = False
    return LegShapes(links, ends, radii)


@njit(cache=True)
def place_capsules(leg, x, y, z, chains, shapes, out):
    """Puts the ends of the capsules of ``leg`` in B into ``out`` (n, 2, 3) with the foot's centre at (x, y, z) in B [m].

    The knee bends as in the nominal stance; a foot out of reach gets the stretched leg.
    """
    haa, thigh, knee, foot = chains.offsets[leg, 0], chains.offsets[leg, 1], chains.offsets[leg, 2], chains.offsets[leg, 3]
    lateral = thigh[1] + knee[1] + foot[1]
    y, z = y - haa[1], z - haa[2]
    below = -np.sqrt(max(y * y + z * z - lateral * lateral, 0.0))
    q0 = np.arctan2(z, y) - np.arctan2(below, lateral)
    px, pz = x - haa[0] - thigh[0], below - thigh[2]
    links = chains.links[leg]
    l1, l2, zero1, zero2 = links[0], links[1], links[2], links[3]
    cosine = (px * px + pz * pz - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
    bend = links[4] * np.arccos(min(1.0, max(-1.0, cosine)))
    q1 = np.arctan2(px, pz) - zero1 - np.arctan2(l2 * np.sin(bend), l1 + l2 * np.cos(bend))
    q2 = bend + zero1 - zero2
    c0, s0, cq, sq = np.cos(q0), np.sin(q0), np.cos(q1), np.sin(q1)
    shank_c, shank_s = np.cos(q1 + q2), np.sin(q1 + q2)
    for k in range(len(shapes.radii[leg])):
        c, s = (cq, sq) if shapes.links[leg, k] == 0 else (shank_c, shank_s)
        for end in range(2):
            ex, ey, ez = shapes.ends[leg, k, end, 0], shapes.ends[leg, k, end, 1], shapes.ends[leg, k, end, 2]
            ex, ez = c * ex + s * ez, -s * ex + c * ez
            if shapes.links[leg, k] == 1:
                ex, ey, ez = ex + cq * knee[0] + sq * knee[2], ey + knee[1], ez - sq * knee[0] + cq * knee[2]
            ex, ey, ez = ex + thigh[0], ey + thigh[1], ez + thigh[2]
            out[k, end, 0] = haa[0] + ex
            out[k, end, 1] = haa[1] + c0 * ey - s0 * ez
            out[k, end, 2] = haa[2] + s0 * ey + c0 * ez


@njit(cache=True)
def segment_distance(a, b):
    """Returns the distance [m] between the segments ``a`` and ``b``, rows are their ends, (2, 3) each.

    Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    d1d1 = d2d2 = d1d2 = d1r = d2r = 0.0
    for i in range(3):
        d1, d2, r = a[1, i] - a[0, i], b[1, i] - b[0, i], a[0, i] - b[0, i]
        d1d1, d2d2, d1d2, d1r, d2r = d1d1 + d1 * d1, d2d2 + d2 * d2, d1d2 + d1 * d2, d1r + d1 * r, d2r + d2 * r
    tiny = 1e-12
    s = t = 0.0
    if d1d1 > tiny and d2d2 > tiny:
        denominator = d1d1 * d2d2 - d1d2 * d1d2
        if denominator > tiny:
            s = min(1.0, max(0.0, (d1d2 * d2r - d1r * d2d2) / denominator))
        t = (d1d2 * s + d2r) / d2d2
        if t < 0.0:
            t, s = 0.0, min(1.0, max(0.0, -d1r / d1d1))
        elif t > 1.0:
            t, s = 1.0, min(1.0, max(0.0, (d1d2 - d1r) / d1d1))
    elif d1d1 > tiny:
        s = min(1.0, max(0.0, -d1r / d1d1))
    elif d2d2 > tiny:
        t = min(1.0, max(0.0, d2r / d2d2))
    total = 0.0
    for i in range(3):
        gap = a[0, i] + s * (a[1, i] - a[0, i]) - b[0, i] - t * (b[1, i] - b[0, i])
        total += gap * gap
    return np.sqrt(total)


@njit(cache=True)
def leg_gap(i, foot_i, j, foot_j, chains, shapes):
    """Returns the least distance [m] between the shapes of legs ``i`` and ``j`` (negative: they are in each other), with
    their feet's centres at ``foot_i`` and ``foot_j``, (3,) each in B."""
    n = len(shapes.radii[i])
    of_i, of_j = np.empty((n, 2, 3)), np.empty((n, 2, 3))
    place_capsules(i, foot_i[0], foot_i[1], foot_i[2], chains, shapes, of_i)
    place_capsules(j, foot_j[0], foot_j[1], foot_j[2], chains, shapes, of_j)
    least = np.inf
    for a in range(n):
        for b in range(n):
            if shapes.radii[i, a] >= 0.0 and shapes.radii[j, b] >= 0.0:
                gap = segment_distance(of_i[a], of_j[b]) - shapes.radii[i, a] - shapes.radii[j, b]
                least = min(least, gap)
    return least


@njit(cache=True)
def are_nearer(i, of_i, j, of_j, shapes, distance):
    """Whether the shapes of legs ``i`` and ``j`` are nearer to each other than ``distance`` [m]: ``leg_gap`` < ``distance``,
    for capsules that ``place_capsules`` has put into ``of_i`` and ``of_j``.

    Most capsules are so far apart along one of B's axes that nothing else has to be looked at.
    """
    for a in range(len(of_i)):
        for b in range(len(of_j)):
            if shapes.radii[i, a] < 0.0 or shapes.radii[j, b] < 0.0:
                continue
            room = distance + shapes.radii[i, a] + shapes.radii[j, b] + _ROUNDING
            apart = False
            for k in range(3):
                a0, a1, b0, b1 = of_i[a, 0, k], of_i[a, 1, k], of_j[b, 0, k], of_j[b, 1, k]
                apart = apart or min(a0, a1) - max(b0, b1) > room or min(b0, b1) - max(a0, a1) > room
            if not apart and segment_distance(of_i[a], of_j[b]) - shapes.radii[i, a] - shapes.radii[j, b] < distance:
                return True
    return False
