"""What the trials of a bench say together: counts, intervals, and comparisons of pairs."""

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binomtest

CONFIDENCE = 0.95
"""Of all intervals."""


@dataclass(frozen=True)
class Score:
    """How many trials reached the goal."""

    reached: int
    trials: int

    @property
    def rate(self) -> float:
        """Share of the trials."""
        return self.reached / self.trials

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the interval of the success rate (Wilson, 1927)."""
        found = binomtest(self.reached, self.trials).proportion_ci(CONFIDENCE, method="wilson")
        return float(found.low), float(found.high)


def grouped(rows: Iterable[dict], names: tuple[str, ...]) -> dict[tuple, list[dict]]:
    """The rows by their values at ``names``, in the order in which these come first."""
    groups: dict[tuple, list[dict]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in names), []).append(row)
    return groups


def tally(rows: Iterable[dict], names: tuple[str, ...]) -> dict[tuple, Score]:
    """The score of each group of rows, see ``grouped``."""
    return {key: score_of(group) for key, group in grouped(rows, names).items()}


def score_of(rows: list[dict]) -> Score:
    """That of some trials."""
    return Score(sum(bool(row["success"]) for row in rows), len(rows))


@dataclass(frozen=True)
class Comparison:
    """Trials that two benches have in common, by who reached the goal."""

    both: int
    only_a: int
    only_b: int
    neither: int

    @property
    def trials(self) -> int:
        """Pairs."""
        return self.both + self.only_a + self.only_b + self.neither

    @property
    def p_value(self) -> float:
        """Of McNemar's exact test: how likely so uneven a split of the differing pairs is when neither is better."""
        differing = self.only_a + self.only_b
        return float(binomtest(self.only_a, differing, 0.5).pvalue) if differing else 1.0


def compared(pairs: Iterable[tuple[bool, bool]]) -> Comparison:
    """Counts pairs of successes, (of A, of B)."""
    counts = {(a, b): 0 for a in (True, False) for b in (True, False)}
    for a, b in pairs:
        counts[bool(a), bool(b)] += 1
    return Comparison(counts[True, True], counts[True, False], counts[False, True], counts[False, False])
