"""References that go on where another one leads."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import PlanStart
from quadpips_drake.values.reference import SETTLING_TIME, FootholdTarget, WholeBodyReference


def trot(request_id, begin, steps, value):
    """``steps`` swings of 0.5 s, diagonal pairs in turn; all states are ``value``."""
    times = begin + 0.01 * np.arange(50 * steps + 1)
    ends = begin + 0.5 * np.arange(steps)
    events = np.column_stack((ends + 0.05, ends + 0.45)).ravel()
    stance, footholds = np.ones((2 * steps + 1, 4), dtype=bool), []
    for k, end in enumerate(ends):
        legs = ((Leg.LF, Leg.RH), (Leg.RF, Leg.LH))[k % 2]
        stance[2 * k + 1, list(legs)] = False
        footholds += [FootholdTarget(leg, end + 0.05, end + 0.45, np.full(3, value), np.zeros(3)) for leg in legs]
    states = np.full((len(times), 24), value)
    return WholeBodyReference(begin, request_id, times, states, states, ContactSchedule(events, stance), tuple(footholds))


@pytest.mark.parametrize("now", [2.3, 2.5, 2.96, 3.2])
def test_a_continued_reference_is_the_one_and_then_the_other(now):
    first, second = trot(1, 0.0, 8, 1.0), trot(2, 3.5, 6, 2.0)
    joined = first.continued_by(second, now)
    assert (joined.stamp, joined.request_id) == (now, 2)
    assert (np.diff(joined.times) > 5e-3).all() and np.diff(joined.times).max() < 0.011
    assert joined.times[0] <= now and joined.end_time == second.end_time
    before = joined.times < 3.5 - 1e-6
    assert (joined.states[before] == 1.0).all() and (joined.states[~before] == 2.0).all()
    for time in np.arange(now - SETTLING_TIME, 6.6, 0.013):
        expected = (first if time < 3.5 else second).schedule.at(time)
        np.testing.assert_array_equal(joined.schedule.at(time), expected)
    for leg in Leg:
        lifted = [s for s in first.schedule.swings(leg) if now < s[1] < 3.5] + second.schedule.swings(leg)
        assert [s for s in joined.schedule.swings(leg) if s[1] > now] == lifted, "swings under way keep their lift-off"
    touchdowns = [f.touchdown_time for f in joined.footholds]
    assert touchdowns == sorted(touchdowns)
    expected = [f for f in first.footholds if now - SETTLING_TIME < f.touchdown_time < 3.5]
    assert joined.footholds == (*expected, *second.footholds)


def test_continuing_again_and_again_does_not_grow():
    joined = trot(1, 0.0, 8, 1.0)
    for k in range(1, 20):
        start = 3.5 * k
        joined = joined.continued_by(trot(1 + k, start, 8, 1.0 + k), start - 0.3)
    assert len(joined.times) < 450 and len(joined.footholds) <= 20 and len(joined.schedule.event_times) <= 20


def test_a_start_survives_shifting():
    start = PlanStart(1, 3.5, np.zeros(24))
    reference = replace(trot(2, 0.0, 2, 1.0), start=start)
    assert trot(1, 0.0, 8, 1.0).continued_by(reference.shifted(3.5, 3.0), 3.0).times[-1] == pytest.approx(4.5)
    assert reference.start is start


def test_a_reference_that_is_ended_comes_to_rest_where_it_was_going():
    walk = trot(1, 0.0, 8, 1.0)
    states = np.zeros((len(walk.times), 24))
    states[:, CentroidalState.POSITION] = walk.times[:, None] * np.array([0.4, 0.0, 0.0])
    states[:, CentroidalState.MOMENTUM] = 0.4
    walk = replace(walk, states=states, inputs=states)
    ended = walk.ended_at(2.0, 1.0)
    assert (ended.stamp, ended.request_id) == (1.0, 1) and 2.1 < ended.end_time < 2.5
    assert (np.diff(ended.times) > 1e-3).all()
    kept = ended.times <= 2.0 + 1e-9
    np.testing.assert_allclose(ended.states[kept, CentroidalState.POSITION][:, 0], 0.4 * ended.times[kept])
    speed = np.diff(ended.states[:, CentroidalState.POSITION][:, 0]) / np.diff(ended.times)
    assert (np.diff(speed) < 1e-9).all() and 0.0 < speed[-1] < 0.1, "slower and slower"
    assert (ended.states[-1, CentroidalState.MOMENTUM] == 0.0).all() and ended.states[~kept, 0].max() < 0.4
    for time in (1.2, 1.98, 2.2, 5.0):
        np.testing.assert_array_equal(ended.schedule.at(time), walk.schedule.at(time) if time < 2.0 else True)
    assert [f.touchdown_time for f in ended.footholds] == [t for t in (0.95, 1.45, 1.95) for _ in range(2)]


def test_full_stances_of_a_schedule():
    stances = trot(1, 0.0, 2, 1.0).schedule.full_stances()
    np.testing.assert_allclose(stances, [(-np.inf, 0.05), (0.45, 0.55), (0.95, np.inf)])
    assert ContactSchedule.standing().full_stances() == [(-np.inf, np.inf)]
