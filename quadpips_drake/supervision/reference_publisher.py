"""When a planned reference becomes the one to follow: a small state machine without Drake."""

from dataclasses import dataclass

from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.reference import WholeBodyReference


@dataclass
class ReferencePublisherConfig(StageConfig):
    """How references are published (QuadPiPS section VII-A)."""

    rate: float = 100.0
    """How often it looks for a new plan [Hz]."""

    time_ahead: float = 0.25
    """A new reference starts so long after it arrives [s] (QuadPiPS: 0.25)."""

    def __post_init__(self):
        super().__post_init__()
        if self.time_ahead < 0.0:
            raise UserInputError(f"reference_publisher.time_ahead must not be negative, is {self.time_ahead}")


@dataclass(frozen=True, eq=False)
class Publication(ImmutableValue):
    """What the publisher remembers."""

    reference: WholeBodyReference
    """In absolute time; without samples while there is nothing to follow."""
    last_id: int = 0
    """Request that was published or dropped last: the same one is not published again."""


def publish(last: Publication, planned: WholeBodyReference, abort: bool, time: float, config) -> Publication:
    """The publication at ``time`` [s].

    Args:
        last: publication so far.
        planned: newest plan, times relative to its start (the first sample at 0).
        abort: drop what is being followed and stand.
        config: ReferencePublisherConfig.
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
    if is_new:
        return Publication(planned.shifted(time + config.time_ahead, time), planned.request_id)
    return last
