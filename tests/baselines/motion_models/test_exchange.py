"""Steps are found in the contacts, whatever trot it is, and not in bounces."""

from pathlib import Path

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.exchange import NOBODY, SAMPLE_RATE, ExchangeMemory, look_for_exchange
from quadpips_drake.baselines.motion_models.state import PAIRS
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.values.legs import Leg

START = 0.5
RECORDED = Path(__file__).with_name("recorded_contacts.npz")
"""Contacts of Go2 at SAMPLE_RATE in two walks of some seconds, which change speed, and the touch-downs that were planned."""


def steps_in(contacts) -> list[tuple[float, int]]:
    """(time, swing) of all steps in ``contacts``: a function of time that gives (4,) flags, over 5 s."""
    memory, found = ExchangeMemory(), []
    for tick in range(int(5.0 * SAMPLE_RATE)):
        memory, begins = look_for_exchange(memory, tick / SAMPLE_RATE, contacts(tick / SAMPLE_RATE))
        if begins:
            found.append((tick / SAMPLE_RATE, memory.swing))
    return found


def as_scheduled(name: str, stop: float = np.inf):
    """Contacts of a robot that stands, walks in a gait from START on, and stands again."""
    schedule = load_gait(name).schedule(START, stop, until=6.0)
    return lambda time: schedule.at(time)


@pytest.mark.parametrize("name", ["trot", "standing_trot", "slow_trot", "flying_trot"])
def test_every_half_cycle_is_a_step_and_pairs_take_turns(name):
    found = steps_in(as_scheduled(name))
    times, swings = np.array(found).T
    assert len(found) == pytest.approx(2 * (5.0 - START) / load_gait(name).duration, abs=1.1)
    np.testing.assert_allclose(np.diff(times)[1:], 0.5 * load_gait(name).duration, atol=1.01 / SAMPLE_RATE)
    assert (np.diff(swings) != 0).all()
    assert found[0][0] == pytest.approx(START, abs=0.006) and found[0][1] == 1  # LF and RH stay down first


def test_a_bounce_and_a_scuff_begin_no_step():
    clean = as_scheduled("trot")

    def bouncing(time):
        contacts = clean(time).copy()
        phase = (time - START) % 0.3
        if time > START and phase < 0.03:
            contacts[:] = phase < 0.015  # all off for a moment after an exchange, as after a hard landing
        if time > START and 0.05 < phase < 0.07:
            contacts[Leg.LF] = True
        return contacts

    assert [swing for _, swing in steps_in(bouncing)] == [swing for _, swing in steps_in(clean)]


def test_a_foot_that_is_not_felt_does_not_end_the_steps():
    clean = as_scheduled("trot")
    deaf = [Leg.LF]

    def without_one(time):
        contacts = clean(time).copy()
        contacts[deaf] = False
        return contacts

    assert len(steps_in(without_one)) == pytest.approx(len(steps_in(clean)), abs=1)


def test_after_standing_steps_are_counted_anew():
    def stops_and_goes_on(time):
        return as_scheduled("standing_trot", stop=1.0)(time if time < 3.0 else time - 2.5)

    found = steps_in(stops_and_goes_on)
    first = next(i for i, (time, _) in enumerate(found) if time > 2.9)
    assert found[0][1] == found[first][1]
    memory = ExchangeMemory()
    for tick in range(int(2.5 * SAMPLE_RATE)):
        memory, _ = look_for_exchange(memory, tick / SAMPLE_RATE, stops_and_goes_on(tick / SAMPLE_RATE))
    assert memory.swing == NOBODY


@pytest.mark.parametrize("name", ["trot", "standing_trot"])
def test_exchanges_are_found_in_recorded_contacts_when_feet_were_to_touch_down(name):
    with np.load(RECORDED) as file:
        contacts, planned, legs = (file[f"{name} {what}"] for what in ("contacts", "touchdown", "leg"))
    contacts = np.unpackbits(contacts).reshape(-1, 4).astype(bool)
    memory, found = ExchangeMemory(), []
    for tick, flags in enumerate(contacts):
        memory, begins = look_for_exchange(memory, tick / SAMPLE_RATE, flags)
        if begins:
            found.append((tick / SAMPLE_RATE, memory.swing))
    last = (len(contacts) - 1) / SAMPLE_RATE
    expected = sorted(
        {(round(time, 3), int(leg in PAIRS[0])) for time, leg in zip(planned, legs, strict=True) if time < last - 0.02}
    )
    times, swings = np.array(found[1:]).T  # the first one is a lift-off
    np.testing.assert_allclose(times, [time for time, _ in expected], atol=0.03)
    np.testing.assert_array_equal(swings, [swing for _, swing in expected])
