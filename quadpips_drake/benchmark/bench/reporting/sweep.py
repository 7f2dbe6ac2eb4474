"""Success against difficulty, and the difficulty at which half of the trials still succeed."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression

from quadpips_drake.benchmark.bench.scores import Score, grouped, tally
from quadpips_drake.terrain.library import terrain_difficulty, terrains


@dataclass(frozen=True)
class Sweep:
    """Scores of one robot and planner on one terrain, in rising order of difficulty."""

    difficulties: np.ndarray
    """In the terrain's own unit, (n,)."""
    scores: list[Score]

    @property
    def rates(self) -> np.ndarray:
        """Shares of the trials that succeeded, (n,)."""
        return np.array([score.rate for score in self.scores])

    def fitted(self) -> np.ndarray:
        """The monotone rates that fit best (least squares, weighted by trials), (n,): falling or rising, what fits better.

        A wider beam is easier, a wider gap is harder, so both directions are tried. Isotonic regression (Barlow et al.,
        1972) assumes nothing else; a logistic curve would, and has no fit where a sweep falls from all to nothing at once.
        """
        trials = [float(score.trials) for score in self.scores]
        fits = [isotonic_regression(self.rates, weights=trials, increasing=rising).x for rising in (False, True)]
        return min(fits, key=lambda fit: float(np.dot(trials, (fit - self.rates) ** 2)))

    def half(self) -> float | None:
        """Where the fitted rates, joined by straight lines, are one half; in the middle where they are that for a while.

        None where they never are: all difficulties are too easy, or all too hard.
        """
        fit = self.fitted()
        order = np.argsort(fit, kind="stable")
        rates, difficulties = fit[order], self.difficulties[order]
        if rates[0] > 0.5 or rates[-1] < 0.5:
            return None
        at_half = difficulties[rates == 0.5]
        if len(at_half):
            return float(0.5 * (at_half.min() + at_half.max()))
        falls = fit[0] > fit[-1]
        below = np.flatnonzero(fit < 0.5)[0 if falls else -1]
        above = np.flatnonzero(fit > 0.5)[-1 if falls else 0]
        ends = sorted((below, above))
        return float(np.interp(0.5, *zip(*sorted((fit[i], self.difficulties[i]) for i in ends), strict=True)))


def difficulty_title(terrain: str) -> str:
    """What the difficulty of a terrain is, with its unit; just "difficulty" where that is not known any more."""
    kind = terrain_difficulty(terrain) if terrain in terrains else None
    if kind is None:
        return "difficulty"
    return kind.title if kind.unit == "1" else f"{kind.title} [{kind.unit}]"


def sweeps_of(rows: list[dict]) -> dict[tuple[str, str, str], Sweep]:
    """The sweeps in some rows, by robot, terrain and planner; none where no difficulties were asked for."""
    swept = [row for row in rows if row["difficulty"] is not None]
    found = {}
    for key, group in grouped(swept, ("robot", "terrain", "planner")).items():
        scores = sorted(tally(group, ("difficulty",)).items(), key=lambda item: item[0])
        found[key] = Sweep(np.array([difficulty for (difficulty,), _ in scores]), [score for _, score in scores])
    return found
