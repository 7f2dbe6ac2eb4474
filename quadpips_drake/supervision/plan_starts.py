"""Where a plan may begin that takes over from a reference: at moments with all feet down (QuadPiPS section VII-A)."""

import numpy as np

from quadpips_drake.values.plans import PlanStart
from quadpips_drake.values.reference import WholeBodyReference

PUBLICATION_TIME = 0.05
"""How long after its status a reference is published at the latest [s]."""
_SAME_TIME = 1e-6
"""Moments closer than this are one [s]."""


def last_stance(reference: WholeBodyReference, before: float, time: float) -> PlanStart | None:
    """A moment of ``reference`` in its last full stance until ``before`` [s]; None if that is over at ``time`` [s]."""
    stances = [(begin, end) for begin, end in reference.schedule.full_stances() if end <= before + _SAME_TIME]
    if not stances:
        return None
    begin, end = max(stances[-1][0], float(reference.times[0])), stances[-1][1]
    moment = max(0.5 * (begin + end), time + PUBLICATION_TIME)
    if moment > end:
        return None
    sample = int(np.searchsorted(reference.times, moment + _SAME_TIME)) - 1
    sample = sample if reference.times[sample] >= time else sample + 1
    return _start_at(reference, sample)


def next_start(reference: WholeBodyReference, earliest: float, replaced_swings: int) -> PlanStart | None:
    """The first moment between two swings from ``earliest`` [s] on, but not before the last ``replaced_swings`` ones.

    The end of the reference counts as well; None after it.
    """
    # Half-way between a touch-down and the lift-off after it.
    events = reference.schedule.event_times
    begins = [*(0.5 * (events[1:-1:2] + events[2::2])), reference.end_time]
    begins = [time for time in begins[-1 - replaced_swings :] if time >= earliest]
    return _start_at(reference, int(np.argmin(np.abs(reference.times - begins[0])))) if begins else None


def _start_at(reference: WholeBodyReference, sample: int) -> PlanStart:
    return PlanStart(reference.request_id, float(reference.times[sample]), reference.states[sample])
