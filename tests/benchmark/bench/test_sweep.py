"""Success against difficulty."""

import numpy as np
import pytest

from quadpips_drake.benchmark.bench.reporting.summary import summary
from quadpips_drake.benchmark.bench.reporting.sweep import Sweep, difficulty_title, sweeps_of
from quadpips_drake.benchmark.bench.scores import Score
from quadpips_drake.benchmark.bench.settings import BenchSettings, Course, difficulties_of
from tests.benchmark.bench.fake_trials import fake_row


def sweep(*reached, trials=10, low=0.0):
    return Sweep(low + np.arange(len(reached)), [Score(count, trials) for count in reached])


@pytest.mark.parametrize(
    ("reached", "half"),
    [
        ((10, 10, 0, 0), 1.5),
        ((0, 0, 10, 10), 1.5),  # a beam: wider is easier
        ((10, 8, 4, 0), 1.75),
        ((10, 5, 0), 1.0),
        ((10, 5, 5, 5, 0), 2.0),
        ((10, 9, 10, 2, 3, 0), 2.0 + 4.5 / 7.0),  # 9 and 10 count as 9.5 each, 2 and 3 as 2.5
        ((10, 10, 9), None),
        ((1, 0, 2), None),
        ((5,), 0.0),
    ],
)
def test_half_succeed_between_easy_and_hard(reached, half):
    assert sweep(*reached).half() == (None if half is None else pytest.approx(half))


def test_what_is_fitted_is_monotone_and_keeps_the_mean():
    noisy = sweep(10, 7, 9, 3, 5, 4, 0)
    fit = noisy.fitted()
    assert (np.diff(fit) <= 0.0).all()
    assert fit.mean() == pytest.approx(noisy.rates.mean())
    assert (np.diff(sweep(0, 4, 5, 3, 9, 7, 10).fitted()) >= 0.0).all()


def test_sweeps_are_found_in_rows_and_told():
    settings = BenchSettings(courses=[Course("go2", "flat")], trials=4, seed=1, difficulties=difficulties_of("0.1:0.3:3"))
    rows = [fake_row(spec) for spec in settings.trial_specs()]
    rows = [{**row, "success": row["difficulty"] < 0.25, "reason": "fell"} for row in rows]
    ((key, found),) = sweeps_of(list(reversed(rows))).items()
    assert key == ("go2", "flat", "quadpips")
    assert found.difficulties.tolist() == [0.1, 0.2, 0.3]
    assert found.scores == [Score(4, 4), Score(4, 4), Score(0, 4)]
    assert found.half() == pytest.approx(0.25)
    text = summary(settings, rows)
    assert "| go2 | flat | quadpips | 0.2 | difficulty | 4/4 | 100 % | 51 % to 100 % |" in text
    assert "| go2 | flat | quadpips | 0.25 | difficulty |" in text
    assert difficulty_title("gap") == "width of the trench [m]"
    assert sweeps_of([{**row, "difficulty": None} for row in rows]) == {}
