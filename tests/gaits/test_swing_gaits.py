"""Gaits as the foothold search sees them come from the one table of gaits."""

import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.gaits.swing_gaits import SwingGait, swing_gait, swing_gait_names
from quadpips_drake.values.legs import Leg

TROT = ((Leg.RF, Leg.LH), (Leg.LF, Leg.RH))
WALK = ((Leg.LH,), (Leg.LF,), (Leg.RH,), (Leg.RF,))


def test_durations_are_the_numbers_that_were_meant():
    """To the bit: 0.9 - 0.5 would be another 0.4."""
    assert swing_gait("standing_trot") == SwingGait("standing_trot", TROT, 0.4, 0.1)
    assert swing_gait("slow_trot") == SwingGait("slow_trot", TROT, 0.3, 0.2)
    assert swing_gait("standing_walk") == SwingGait("standing_walk", WALK, 0.4, 0.1)


def test_the_known_ones():
    assert set(swing_gait_names()) == {"standing_trot", "slow_trot", "standing_walk"}


@pytest.mark.parametrize("name", swing_gait_names())
def test_phases_are_the_swings_of_the_gait(name):
    gait, phases = load_gait(name), swing_gait(name)
    schedule = gait.schedule(0.0, stop=gait.duration)
    for k, legs in enumerate(phases.phases):
        liftoff = k * (phases.swing_duration + phases.stance_duration)
        for leg in Leg:
            assert schedule.at(liftoff + 0.5 * phases.swing_duration)[leg] == (leg not in legs)
        assert schedule.at(liftoff + phases.swing_duration + 0.5 * phases.stance_duration).all()


@pytest.mark.parametrize("name", ["trot", "stance", "amble", "standing_pace", "gallop"])
def test_a_gait_that_cannot_be_planned_is_refused(name):
    with pytest.raises(UserInputError, match=f"unknown planning gait '{name}'; known: .*standing_trot"):
        swing_gait(name)
