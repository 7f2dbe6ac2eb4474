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


class Records(NamedTuple):
    """All records of the same swinging legs, a column each; a NamedTuple of float32 arrays, which numba takes as it is."""

    before: np.ndarray
    """Footholds before, coordinates of all feet (12, n) [m]."""
    first: np.ndarray
    """Where the first of the legs came down, (3, n) [m] ..."""
    last: np.ndarray
    """... and the last, (3, n) [m]."""
    attempts: np.ndarray
    """How often, less what was forgotten, (n,)."""
    cost: np.ndarray
    """Mean optimal cost, (n,)."""


@dataclass(frozen=True)
class EdgeExperience:
    """The experience of one search, taken before it."""

    scope: str
    records: dict[int, Records]
    """By ``leg_bits``."""
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
        records, coordinates = {}, (library.before.reshape(-1, 12), library.after.reshape(-1, 12))
        for bits in np.flatnonzero(np.bincount(library.legs)).tolist():
            rows, legs = np.flatnonzero(library.legs == bits), [leg for leg in range(4) if bits >> leg & 1]
            records[bits] = Records(*_of_legs(rows, legs[0], legs[-1], *coordinates, attempts, library.cost))
        return cls(library.scope, records, config.weight, config.scale, config.width, config.start_width)

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
        records = self.records.get(leg_bits(legs))
        if records is None or not len(after):
            return np.zeros(len(after))
        before, landed = in_scope(self.scope, before, after[:, [legs[0], legs[-1]]].reshape(-1, 3))
        rates = np.float32(0.5 / self.width**2), np.float32(0.5 / self.start_width**2)
        return _costs(before, landed, len(legs) > 1, records, *rates, self.weight, self.scale)


@njit(cache=True, nogil=True)
def _of_legs(rows, first, last, before, after, attempts, cost):
    """The fields of Records: some rows of a library, footholds as (n, 12)."""
    n = len(rows)
    befores, firsts, lasts = np.empty((12, n), np.float32), np.empty((3, n), np.float32), np.empty((3, n), np.float32)
    for j in range(12):
        for i in range(n):
            befores[j, i] = before[rows[i], j]
    for j in range(3):
        for i in range(n):
            firsts[j, i], lasts[j, i] = after[rows[i], 3 * first + j], after[rows[i], 3 * last + j]
    return befores, firsts, lasts, attempts[rows].astype(np.float32), cost[rows].astype(np.float32)


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
def _columns(points, chosen):
    """Some columns of ``points`` (m, n); these themselves if that is all."""
    if len(chosen) == points.shape[1]:
        return points
    out = np.empty((len(points), len(chosen)), points.dtype)
    for j in range(len(points)):
        row, found = points[j], out[j]
        for i in range(len(chosen)):
            found[i] = row[chosen[i]]
    return out


@njit(cache=True, nogil=True)
def _exponents(places, count, points, rate):
    """Those between the columns of ``places`` and of ``points`` (3, n), (count, n), and the least of each point, (n,)."""
    n = points.shape[1]
    out, least = np.empty((count, n), np.float32), np.full(n, np.float32(np.inf))
    for a in range(count):
        x, y, z, row = places[0, a], places[1, a], places[2, a], out[a]
        for i in range(n):
            dx, dy, dz = points[0, i] - x, points[1, i] - y, points[2, i] - z
            row[i] = rate * (dx * dx + dy * dy + dz * dz)
            least[i] = min(least[i], row[i])
    return out, least


@njit(cache=True, nogil=True)
def _fall_off(exponents):
    """Replaces each exponent x by exp(-x): by (1 - t + t^2 / 2)^64 with t = min(x / 64, 1), which is quicker, less than
    0.4 % off up to x = 4.5, and next to nothing for large ones."""
    values = exponents.ravel()
    for i in range(len(values)):
        rest = max(np.float32(1.0) - values[i] * np.float32(1.0 / 64.0), np.float32(0.0))
        y = np.float32(0.5) + np.float32(0.5) * rest * rest  # with rest = 1 - t
        y *= y
        y *= y
        y *= y
        y *= y
        y *= y
        values[i] = y * y


@njit(cache=True, nogil=True)
def _start_exponents(before, records, rate):
    """Those of the footholds before (12,), (n,)."""
    total = np.zeros(records.shape[1], np.float32)
    for j in range(len(before)):
        value, row = before[j], records[j]
        for i in range(len(total)):
            total[i] += (row[i] - value) ** 2
    return rate * total


@njit(cache=True, nogil=True)
def _costs(before, landed, in_pairs, records, rate, start_rate, weight, scale):
    """Returns what each transition costs by the mean over attempts like it [m], (k,).

    Args: ground points before [m], (4, 3), and where the first and the last leg land each time [m], (2 k, 3); whether these
    are two; their Records; ``rate``, ``start_rate``, float32; ``weight``, ``scale``.

    Two legs land in few places each, of which the transitions are combinations: so the function is a product, and its sums
    over the records are one product of matrices. Numbers of 32 bits: they come in twice as many at once.
    """
    k = len(landed) // 2
    places_a, places_b = np.empty((3, k), np.float32), np.empty((3, k), np.float32)
    which_a, which_b = np.empty(k, np.int64), np.zeros(k, np.int64)
    landed = landed.astype(np.float32)
    starts = _start_exponents(before.ravel().astype(np.float32), records.before, start_rate)
    near = np.flatnonzero(starts <= _FARTHEST)
    count_a, least = _distinct_places(landed[::2], places_a, which_a), starts[near]
    by_a, least_a = _exponents(places_a, count_a, _columns(records.first, near), rate)
    least += least_a
    count_b, by_b = 1, np.zeros((1, len(near)), np.float32)
    if in_pairs:
        count_b = _distinct_places(landed[1::2], places_b, which_b)
        by_b, least_b = _exponents(places_b, count_b, _columns(records.last, near), rate)
        least += least_b
    kept = np.flatnonzero(least <= _FARTHEST)
    like_a, like_b = _columns(by_a, kept), np.empty((2 * count_b, len(kept)), np.float32)
    _fall_off(like_a)
    like_b[:count_b] = _columns(by_b, kept)
    _fall_off(like_b[:count_b])
    kept = near[kept]
    like_starts = starts[kept]
    _fall_off(like_starts)
    like_b[:count_b] *= records.attempts[kept] * like_starts
    like_b[count_b:] = like_b[:count_b] * records.cost[kept]
    sums = np.dot(like_a, like_b.T)
    costs = np.empty(k)
    for j in range(k):
        a, b = which_a[j], which_b[j]
        costs[j] = weight * np.tanh(sums[a, count_b + b] / max(np.float32(1.0), sums[a, b]) / scale)
    return costs
