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
    """n records of the same swinging legs; a NamedTuple of read-only arrays, so that numba takes it as it is."""

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
    tables: dict
    """ExperienceTable by ``leg_bits``."""
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
        tables = {}
        for bits in np.unique(library.legs):
            those = library.legs == bits
            columns = (library.before[those], library.after[those], attempts[those], library.cost[those])
            tables[int(bits)] = ExperienceTable(*(np.ascontiguousarray(column, float) for column in columns))
        return cls(library.scope, tables, config.weight, config.scale, config.width, config.start_width)

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
        table = self.tables.get(leg_bits(legs))
        if table is None or not len(after):
            return np.zeros(len(after))
        before, after = in_scope(self.scope, before, after)
        rates = 0.5 / self.width**2, 0.5 / self.start_width**2
        return _costs(legs, before, after, table, *rates, self.weight, self.scale)


@njit(cache=True, nogil=True)
def _distinct_places(points, places, which):
    """Writes the different rows of ``points`` (k, 3) into ``places`` and the index of each into ``which``; how many."""
    count = 0
    for k in range(len(points)):
        found = count
        for i in range(count - 1, -1, -1):  # the last one is the likeliest
            if places[i, 0] == points[k, 0] and places[i, 1] == points[k, 1] and places[i, 2] == points[k, 2]:
                found = i
                break
        if found == count:
            places[count, 0], places[count, 1], places[count, 2] = points[k, 0], points[k, 1], points[k, 2]
            count += 1
        which[k] = found
    return count


@njit(cache=True, nogil=True)
def _exponents(places, count, point, rate, out):
    """Writes those between ``point`` and the places; the least of them."""
    least = np.inf
    for i in range(count):
        dx, dy, dz = places[i, 0] - point[0], places[i, 1] - point[1], places[i, 2] - point[2]
        out[i] = rate * (dx * dx + dy * dy + dz * dz)
        least = min(least, out[i])
    return least


@njit(cache=True, nogil=True)
def _costs(legs, before, after, table, rate, start_rate, weight, scale):
    """Returns what each transition costs by the mean over attempts like it [m], (k,).

    Two legs land in few places each, of which the transitions are combinations: so the function is a product.
    """
    k, first, last = len(after), legs[0], legs[-1]
    places_a, places_b = np.empty((k, 3)), np.empty((k, 3))
    which_a, which_b = np.empty(k, np.int64), np.zeros(k, np.int64)
    count_a, count_b = _distinct_places(after[:, first], places_a, which_a), 1
    if last != first:
        count_b = _distinct_places(after[:, last], places_b, which_b)
    weights, totals = np.zeros((count_a, count_b)), np.zeros((count_a, count_b))
    near_a, near_b = np.zeros(count_a), np.zeros(count_b)
    for i in range(len(table.cost)):
        start = 0.0
        for leg in range(4):
            for j in range(3):
                start += (before[leg, j] - table.before[i, leg, j]) ** 2
            if start_rate * start > _FARTHEST:
                break
        start *= start_rate
        if start > _FARTHEST:
            continue
        least = start + _exponents(places_a, count_a, table.after[i, first], rate, near_a)
        if last != first:
            least += _exponents(places_b, count_b, table.after[i, last], rate, near_b)
        if least > _FARTHEST:
            continue
        for b in range(count_b):
            near_b[b] = np.exp(-near_b[b])
        for a in range(count_a):
            likeness = table.attempts[i] * np.exp(-start - near_a[a])
            for b in range(count_b):
                weights[a, b] += likeness * near_b[b]
                totals[a, b] += likeness * near_b[b] * table.cost[i]
        for b in range(count_b):
            near_b[b] = 0.0
    costs = np.empty(k)
    for j in range(k):
        mean = totals[which_a[j], which_b[j]] / max(1.0, weights[which_a[j], which_b[j]])
        costs[j] = weight * np.tanh(mean / scale)
    return costs
