"""Two quintic pieces over an apex: their coefficients, their values, and an apex that clears the ground; in numba."""

import numpy as np
from numba import njit

START, END = 0, 1
"""Where a path holds its times [s]."""
_POINTS, _PIECES = 2, 8
"""Where it holds both end points, and where its coefficients begin."""
PATH_SIZE = _PIECES + 36
_MIN_HORIZONTAL = 0.01
"""Below this horizontal distance [m] the apex lies straight above."""
APEX_PART = 0.6
"""Part of the chord that is behind the foot at half time: it lands more slowly than it leaves."""
_OTHER_PARTS = (0.45, 0.3, 0.75, 0.15, 0.85)
"""Where else the apex may be to clear an edge close to one end."""
_HEIGHT_STEP = 0.01
"""[m]"""
_PRICE_OF_RISE = 0.05
"""An apex rises by so much only for this part of it in clearance [1]."""
_TESTED = 40
"""Points of a swing that are held against the ground [1]."""
_AT_AN_END = 4
"""Of them, how many at either end belong to the foothold rather than to the way [1]."""
_FLAT_END = 0.25
"""The wanted clearance fades, as a parabola, within this part of the swing from both ends [1]."""


@njit(cache=True)
def _apex(p0, p1, duration, height, part):
    """Returns position and velocity at half time, (2, 3)."""
    out = np.zeros((2, 3))
    x, y, z = p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]
    horizontal = np.hypot(x, y)
    if horizontal < _MIN_HORIZONTAL:
        for i in range(3):
            out[0, i] = 0.5 * (p0[i] + p1[i])
        out[0, 2] = max(p0[2], p1[2]) + height
        return out
    length = np.hypot(horizontal, z)
    # Perpendicular to the chord in the vertical plane that holds it, pointing up.
    raised = (-z * x / horizontal / length, -z * y / horizontal / length, horizontal / length)
    # Slower where one half of the way is short, or the foot would have to back up for it.
    speed = min(2.0, 5.0 * part, 5.0 * (1.0 - part))
    for i in range(3):
        chord = p1[i] - p0[i]
        out[0, i] = p0[i] + part * chord + height * raised[i]
        out[1, i] = speed * chord / duration
    return out


@njit(cache=True)
def _quintic(p0, v0, p1, v1, duration, out):
    """Coefficients of the quintic with these end points and velocities and no end acceleration: six for each axis."""
    t = duration
    for i in range(3):
        d, k = p1[i] - p0[i], 6 * i
        out[k], out[k + 1], out[k + 2] = p0[i], v0[i], 0.0
        out[k + 3] = (10 * d - (6 * v0[i] + 4 * v1[i]) * t) / t**3
        out[k + 4] = (-15 * d + (8 * v0[i] + 7 * v1[i]) * t) / t**4
        out[k + 5] = (6 * d - 3 * (v0[i] + v1[i]) * t) / t**5


@njit(cache=True)
def swing_path(p0, v0, p1, v1, duration, height, part):
    """A swing from time 0 on with its apex ``height`` [m] over that part of the chord, as one array (PATH_SIZE,): start and
    end [s], both points, and for both pieces the coefficients of x, y, z, constant first."""
    path = np.empty(PATH_SIZE)
    path[START], path[END] = 0.0, duration
    for i in range(3):
        path[_POINTS + i], path[_POINTS + 3 + i] = p0[i], p1[i]
    middle = _apex(p0, p1, duration, height, part)
    _quintic(p0, v0, middle[0], middle[1], 0.5 * duration, path[_PIECES:])
    _quintic(middle[0], middle[1], p1, v1, 0.5 * duration, path[_PIECES + 18 :])
    return path


@njit(cache=True)
def evaluate_swing(path, t, out):
    """Writes position, velocity and acceleration at ``t`` into out (3, 3); at rest outside of the swing."""
    start, end = path[START], path[END]
    if t <= start or t >= end:
        out[:] = 0.0
        for i in range(3):
            out[0, i] = path[_POINTS + i] if t <= start else path[_POINTS + 3 + i]
        return
    s, half, first = t - start, 0.5 * (end - start), _PIECES
    if s >= half:
        first, s = _PIECES + 18, s - half
    for i in range(3):
        k = first + 6 * i
        c0, c1, c2, c3, c4, c5 = path[k], path[k + 1], path[k + 2], path[k + 3], path[k + 4], path[k + 5]
        out[0, i] = c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))
        out[1, i] = c1 + s * (2 * c2 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))
        out[2, i] = 2 * c2 + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))


@njit(cache=True)
def sample_swing(path, times, out):
    """Writes position, velocity and acceleration at several times into out (n, 3, 3)."""
    for k in range(len(times)):
        evaluate_swing(path, times[k], out[k])


@njit(cache=True)
def least_clearance(path, duration, p0, p1, profile, clearance, first):
    """Smallest height over the ground profile, less the wanted clearance (which fades towards both ends) [m].

    ``first``: the point that is tested first; as many are left out at the other end.
    """
    chord = (p1[0] - p0[0], p1[1] - p0[1])
    horizontal2 = chord[0] * chord[0] + chord[1] * chord[1]
    point = np.empty((3, 3))
    least, last = np.inf, len(profile) - 1
    for k in range(first, _TESTED + 1 - first):
        phase = k / _TESTED
        evaluate_swing(path, phase * duration, point)
        part = phase
        if horizontal2 > _MIN_HORIZONTAL**2:
            part = ((point[0, 0] - p0[0]) * chord[0] + (point[0, 1] - p0[1]) * chord[1]) / horizontal2
        position = min(max(part, 0.0), 1.0) * last
        i = int(position)
        ground = max(profile[i], profile[min(i + 1, last)])
        if i == position:
            ground = profile[i]
        wanted = clearance * min(1.0, phase / _FLAT_END, (1.0 - phase) / _FLAT_END) ** 2
        least = min(least, point[0, 2] - ground - wanted)
    return least


@njit(cache=True)
def clearing_path(p0, v0, p1, v1, duration, height, profile, clearance, max_rise):
    """As ``swing_path``, with the lowest apex that clears the profile, and by how much that is above ``height`` [m].

    When none does, it comes near to it; but an apex does not rise by much for little: a map that is wrong by a centimetre
    beside a foot would have it swing as high, and so as fast, as it can. Between apexes of the same height the usual place
    is preferred.
    """
    best = swing_path(p0, v0, p1, v1, duration, height, APEX_PART)
    best_missing = max(0.0, -least_clearance(best, duration, p0, p1, profile, clearance, 1))
    rise, best_rise, cleared = 0.0, 0.0, best_missing == 0.0
    while not cleared and rise <= max_rise + 1e-9:
        for option in range(1 + len(_OTHER_PARTS)):
            part = APEX_PART if option == 0 else _OTHER_PARTS[option - 1]
            path = swing_path(p0, v0, p1, v1, duration, height + rise, part)
            missing = max(0.0, -least_clearance(path, duration, p0, p1, profile, clearance, 1))
            if missing + _PRICE_OF_RISE * rise < best_missing + _PRICE_OF_RISE * best_rise - 1e-12:
                best, best_missing, best_rise = path, missing, rise
            cleared = cleared or missing == 0.0
            if missing == 0.0:
                break
        rise += _HEIGHT_STEP
    return best, best_rise


@njit(cache=True)
def depth_on_the_way(path, duration, p0, p1, profile):
    """By how much the swing is below the profile [m], but for its ends, where a foot stands beside what is there."""
    return max(0.0, -least_clearance(path, duration, p0, p1, profile, 0.0, _AT_AN_END))
