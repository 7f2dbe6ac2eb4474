"""Where a plan may take over from a reference."""

import pytest

from quadpips_drake.supervision.plan_starts import last_stance, next_start
from tests.supervision.walked_references import trot


@pytest.mark.parametrize(("replaced", "begin"), [(0, 4.05), (1, 3.5), (2, 3.0), (5, 2.5)])
def test_how_many_swings_are_replaced(replaced, begin):
    """Of eight, 4.05 s long, from 2.4 s on."""
    assert next_start(trot(1, 0.0, 8, 1.0), 2.4, replaced).time == pytest.approx(begin, abs=0.06)
    assert next_start(trot(1, 0.0, 8, 1.0), 4.2, replaced) is None


def test_the_last_stance_before_a_moment():
    reference = trot(3, 0.0, 8, 1.0)
    assert last_stance(reference, 2.05, 1.0).time == pytest.approx(2.0)
    assert last_stance(reference, 2.3, 1.0).time == pytest.approx(2.0), "in the middle of a swing: before it"
    assert last_stance(reference, 2.05, 1.98).time == pytest.approx(2.0), "as soon as can be"
    assert last_stance(reference, 2.05, 2.03) is None
    assert last_stance(reference, 0.05, -0.25).time == pytest.approx(0.0)
    assert last_stance(reference, 0.01, -0.25) is None
