"""When a planned reference becomes the one to follow: a small state machine without Drake."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.reference import ReferenceCut, WholeBodyReference


@configuration
class ReferencePublisherConfig(StageConfig):
    """How references are published (QuadPiPS section VII-A)."""

    rate: float = stage_rate(100.0)
    """How often it looks for a new plan [Hz]."""

    time_ahead: float = ranged(0.25, 0.0, 10.0)
    """A new reference starts so long after it arrives [s] (QuadPiPS: 0.25)."""


@dataclass(frozen=True, eq=False)
class Publication(ImmutableValue):
    """What the publisher remembers."""

    reference: WholeBodyReference
    """In absolute time; without samples while there is nothing to follow."""
    last_id: int = 0
    """Request that was published or dropped last: the same one is not published again."""
    cut_at: float = np.inf
    """Where ``reference`` was cut off [s]; inf: nowhere."""


def publish(
    last: Publication,
    planned: WholeBodyReference,
    abort: bool,
    time: float,
    config,
    cut: ReferenceCut | None = None,
) -> Publication:
    """The publication at ``time`` [s].

    Args:
        last: publication so far.
        planned: newest plan, times relative to its start (the first sample at 0). One that was made ahead continues the
            reference that it was made for, if it is still in time; otherwise it is left out.
        abort: drop what is being followed and stand.
        config: ReferencePublisherConfig.
        cut: where the reference that is being followed shall end; a plan that was made ahead from there or from an earlier
            moment may still continue it.
    """
    is_new = planned.request_id > last.last_id and len(planned.times) > 1
    if abort:
        # A plan made before the abort is stale: it started from a state that the robot has left.
        dropped = max(last.last_id, planned.request_id)
        return (
            last
            if len(last.reference.times) == 0 and dropped == last.last_id
            else Publication(WholeBodyReference.empty(time), dropped)
        )
    last = _cut_off(last, cut, time)
    if not is_new:
        return last
    if planned.start is None:
        return Publication(planned.shifted(time + config.time_ahead, time), planned.request_id)
    begin = planned.start.time
    if planned.start.follows != last.reference.request_id or not time <= begin <= last.cut_at:
        # Made ahead for something that is no longer followed, or ready only after it was to begin.
        return replace(last, last_id=planned.request_id)
    return Publication(last.reference.continued_by(planned.shifted(planned.start.time, time), time), planned.request_id)


def _cut_off(last: Publication, cut: ReferenceCut | None, time: float) -> Publication:
    """The publication with its reference cut off, if that is wanted, can still be done, and has not been done."""
    reference = last.reference
    wanted = cut is not None and cut.follows > 0 and cut.follows == reference.request_id and len(reference.times)
    if not wanted or not time <= cut.time < min(last.cut_at, reference.end_time):
        return last
    return replace(last, reference=reference.ended_at(cut.time, time), cut_at=cut.time)
