"""What a transition costs by experience: the mean optimal cost of all attempts at transitions like it.

With k_i the radial basis function between a transition and record i, n_i its attempts and c_i their mean cost,

    k_i = exp(-sum over swinging legs |a - a_i|^2 / 2 width^2 - sum over all legs |b - b_i|^2 / 2 start_width^2),
    cost = weight tanh(m / scale),    m = sum_i k_i n_i c_i / max(1, sum_i k_i n_i),

where b and a are the footholds before and after. Far from everything that was tried it is 0: the unknown is worth a try.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.learning import in_scope, leg_bits
from quadpips_drake.values.swing_plan import ExperienceLibrary

_FARTHEST = 4.5
"""Exponent from which on a record counts nothing [1]: three standard deviations."""


class ExperienceTable(NamedTuple):
    """The records of a library; a NamedTuple of its read-only arrays, so that numba takes it as it is."""

    before: np.ndarray
    """(n, 4, 3) [m]."""
    after: np.ndarray
    """(n, 4, 3) [m]."""
    attempts: np.ndarray
    """How often, less what was forgotten, (n,)."""
    cost: np.ndarray
    """Mean optimal cost, (n,)."""


@dataclass(frozen=True)
class EdgeExperience:
    """The experience of one search, taken before it."""

    scope: str
    table: ExperienceTable
    rows: dict
    """Numbers of its records by ``leg_bits``, int64 each."""
    weight: float
    """[m]"""
    scale: float
    """[1]"""
    width: float
    """[m]"""
    start_width: float
    """[m]"""

    @classmethod
    def of(cls, library: ExperienceLibrary, config: ExperienceConfig) -> "EdgeExperience | None":
        """What ``library`` says to a search; None if it says nothing."""
        if not len(library) or config.weight == 0.0:
            return None
        attempts = library.count.astype(float)
        if config.half_life > 0.0:
            attempts *= 0.5 ** ((library.trials - library.last) / config.half_life)
        attempts.flags.writeable = False
        table = ExperienceTable(library.before, library.after, attempts, library.cost)
        rows = {int(bits): np.flatnonzero(library.legs == bits) for bits in np.flatnonzero(np.bincount(library.legs))}
        return cls(library.scope, table, rows, config.weight, config.scale, config.width, config.start_width)

    def weighed(self, factor: float) -> "EdgeExperience":
        """The same with ``factor`` times the weight."""
        return self if factor == 1.0 else replace(self, weight=factor * self.weight)

    def costs(self, legs: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Returns what transitions from one stance cost [m], (k,), all of them at least 0.

        Args:
            legs: one or two that swing, int64.
            before: ground points of the feet [m], (4, 3).
            after: ... after each transition [m], (k, 4, 3).
        """
        rows = self.rows.get(leg_bits(legs))
        if rows is None or not len(after):
            return np.zeros(len(after))
        before, after = in_scope(self.scope, before, after)
        rates = 0.5 / self.width**2, 0.5 / self.start_width**2
        return _costs(legs, before, after, self.table, rows, *rates, self.weight, self.scale)


@njit(cache=True, nogil=True)
def _distinct_places(points, places, which):
    """Writes the different rows of ``points`` (k, 3) into the columns of ``places`` (3, k) and the index of each into
    ``which``; returns how many."""
    count = 0
    for k in range(len(points)):
        found = count
        for i in range(count - 1, -1, -1):  # the last one is the likeliest
            if places[0, i] == points[k, 0] and places[1, i] == points[k, 1] and places[2, i] == points[k, 2]:
                found = i
                break
        if found == count:
            for j in range(3):
                places[j, count] = points[k, j]
            count += 1
        which[k] = found
    return count


@njit(cache=True, nogil=True)
def _exponents(places, count, point, rate, out):
    """Writes those between ``point`` and the places; returns the least of them."""
    x, y, z = point[0], point[1], point[2]
    for i in range(count):
        dx, dy, dz = places[0, i] - x, places[1, i] - y, places[2, i] - z
        out[i] = rate * (dx * dx + dy * dy + dz * dz)
    least = np.inf
    for i in range(count):
        least = min(least, out[i])
    return least


@njit(cache=True, nogil=True)
def _fall_off(exponents, count):
    """Replaces each exponent x by exp(-x): by (1 - x / 64)^64, which is quicker and less than 1 % off up to x = 1."""
    for i in range(count):
        y = max(1.0 - exponents[i] / 64.0, 0.0)
        y *= y
        y *= y
        y *= y
        y *= y
        y *= y
        exponents[i] = y * y


@njit(cache=True, nogil=True)
def _start_exponent(before, record, rate):
    """That of the footholds before, as far as it matters."""
    total = 0.0
    for leg in range(4):
        for j in range(3):
            total += (before[leg, j] - record[leg, j]) ** 2
        if rate * total > _FARTHEST:
            break
    return rate * total


@njit(cache=True, nogil=True)
def _costs(legs, before, after, table, rows, rate, start_rate, weight, scale):
    """Returns what each transition costs by the mean over attempts like it [m], (k,).

    Two legs land in few places each, of which the transitions are combinations: so the function is a product.
    """
    k, first, last = len(after), legs[0], legs[-1]
    places_a, places_b = np.empty((3, k)), np.empty((3, k))
    which_a, which_b = np.empty(k, np.int64), np.zeros(k, np.int64)
    count_a, count_b = _distinct_places(after[:, first], places_a, which_a), 1
    if last != first:
        count_b = _distinct_places(after[:, last], places_b, which_b)
    weights, totals = np.zeros((count_a, count_b)), np.zeros((count_a, count_b))
    near_a, near_b = np.zeros(count_a), np.zeros(count_b)
    for i in rows:
        start = _start_exponent(before, table.before[i], start_rate)
        if start > _FARTHEST:
            continue
        least = start + _exponents(places_a, count_a, table.after[i, first], rate, near_a)
        near_b[:] = 0.0
        if last != first:
            least += _exponents(places_b, count_b, table.after[i, last], rate, near_b)
        if least > _FARTHEST:
            continue
        _fall_off(near_a, count_a)
        _fall_off(near_b, count_b)
        attempts = table.attempts[i] * np.exp(-start)
        for a in range(count_a):
            likeness = attempts * near_a[a]
            cost = likeness * table.cost[i]
            for b in range(count_b):
                weights[a, b] += likeness * near_b[b]
                totals[a, b] += cost * near_b[b]
    costs = np.empty(k)
    for j in range(k):
        mean = totals[which_a[j], which_b[j]] / max(1.0, weights[which_a[j], which_b[j]])
        costs[j] = weight * np.tanh(mean / scale)
    return costs
