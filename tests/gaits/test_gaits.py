"""Gaits: cycles, schedules, names."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.gaits.gaits import GAITS, load_gait
from quadpips_drake.values.legs import Leg


@pytest.mark.parametrize("name", sorted(GAITS))
def test_times_increase_and_every_leg_of_a_walk_swings_in_every_cycle(name):
    gait = load_gait(name)
    assert len(gait.modes) == len(gait.end_times)
    assert np.all(np.diff((0.0, *gait.end_times)) > 0.0)
    schedule = gait.schedule(0.0, stop=3.0 * gait.duration)
    for leg in Leg:
        swings = schedule.swings(leg)
        # A swing may go on over the end of a cycle, so that the walk's own begin and end cut it in two.
        assert len(swings) in ((0,) if name == "stance" else (3, 4))
        assert all(np.isfinite(bound) for swing in swings for bound in swing)


def test_standing_trot_swings_the_diagonals_in_turn():
    schedule = load_gait("standing_trot").schedule(1.0, stop=2.0)
    assert schedule.at(0.99).all()
    assert schedule.at(1.2).tolist() == [True, False, False, True]
    assert schedule.at(1.45).all()
    assert schedule.at(1.7).tolist() == [False, True, True, False]
    assert schedule.at(2.0).all()
    assert schedule.swings(Leg.LF) == [(1.5, 1.9)]


def test_a_walk_ends_with_a_complete_cycle():
    schedule = load_gait("trot").schedule(0.0, stop=0.7)
    assert schedule.event_times[-1] == pytest.approx(1.2)
    assert schedule.at(1.21).all()
    assert load_gait("trot").schedule(0.0, stop=-1.0).at(0.1).all()


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(UserInputError, match="standing_trot"):
        load_gait("gallop")
