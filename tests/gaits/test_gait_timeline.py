"""Timelines of gaits: phases go on, and changes leave no foot in the air."""

import itertools

import numpy as np
import pytest

from quadpips_drake.gaits.gait_timeline import GaitSegment, GaitTimeline, standing_timeline
from quadpips_drake.gaits.gaits import GAITS, load_gait
from quadpips_drake.values.legs import Leg

MOVING = [name for name in GAITS if name != "stance"]


@pytest.mark.parametrize("name", MOVING)
def test_the_schedule_is_that_of_the_gait(name):
    gait = load_gait(name)
    timeline = GaitTimeline((GaitSegment(gait, 1.0),))
    own, expected = timeline.schedule(1.0, 8.0), gait.schedule(1.0, until=8.0)
    for time in np.arange(1.0 + gait.duration, 5.0, 0.0371):  # in the first cycle a foot may not yet be lifted
        assert (own.at(time) == expected.at(time)).all(), (name, time)


def test_the_phase_goes_on():
    segment = GaitSegment(load_gait("trot"), 1.0, 0.5)
    assert segment.phase_at(1.0) == pytest.approx(0.5)
    assert segment.phase_at(1.45) == pytest.approx(0.25)
    assert all(liftoff >= 1.0 - 1e-6 for _, liftoff, _ in segment.swings(0.0, 5.0))


@pytest.mark.parametrize(("before", "after"), [*itertools.product(MOVING, ["trot", "amble", "static_walk", "stance"])])
def test_a_change_of_gait_finishes_all_swings(before, after):
    if before == after:
        return
    start = GaitTimeline((GaitSegment(load_gait(before), 0.0),))
    for now in (2.0, 2.21, 2.37):
        timeline = start.changed_to(load_gait(after), now, lead=0.04, pause=0.05)
        closed, new = timeline.segments
        assert closed.settled() + 0.05 == pytest.approx(new.start)
        schedule = timeline.schedule(now, now + 4.0)
        assert schedule.at(new.start - 0.01).all()
        old = start.schedule(now, now + 4.0)
        assert (schedule.at(now) == old.at(now)).all(), "the present stays as it is"
        for leg in Leg:
            lengths = [touchdown - liftoff for liftoff, touchdown in schedule.swings(leg) if liftoff > 0.0]
            allowed = {round(b - a, 4) for g in (before, after) for a, b in load_gait(g).schedule(0.0, 9.0).swings(leg)}
            assert {round(length, 4) for length in lengths} <= allowed, "swings are neither cut nor joined"


def test_trot_alternates_through_a_change():
    trot = GaitTimeline((GaitSegment(load_gait("trot"), 0.0),))
    timeline = trot.changed_to(load_gait("standing_trot"), 0.75, lead=0.04, pause=0.05)
    new = timeline.segments[-1]
    first = min(new.swings(0.0, 5.0), key=lambda swing: swing[1])
    assert new.start == pytest.approx(0.95)
    assert first[0] in (Leg.LF, Leg.RH), "RF and LH have just landed"


def test_a_pending_change_is_replaced():
    timeline = standing_timeline(load_gait("stance")).changed_to(load_gait("trot"), 1.0, lead=0.04, pause=0.3)
    changed = timeline.changed_to(load_gait("pace"), 1.1, lead=0.04, pause=0.3)
    assert [segment.gait.name for segment in changed.segments] == ["stance", "pace"]
    assert changed.segments[-1].start == timeline.segments[-1].start
