"""A trial under examination: what is known of it, the events of its end, and what may have caused them."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quadpips_drake.trials.explaining.first_events import Event, chain_of, events_of
from quadpips_drake.trials.explaining.last_moments import LastMoments, moments_of
from quadpips_drake.trials.reporting.suspects import suspects_of
from quadpips_drake.trials.reporting.trial_record import TrialRecord


@dataclass(frozen=True)
class Finding:
    """Something measured that should not be so, and that may be why a trial failed."""

    cause: str
    """In two or three words: "low friction"."""
    time: float
    """Since when [s]."""
    text: str
    """What was measured, a sentence without its full stop."""
    system: str
    """Of the diagram, where to look."""
    keys: tuple[str, ...]
    """Of the configuration, the most likely one first."""
    weight: float
    """How well it explains the end, from 0 to 1."""


class Case:
    """Everything that causes are looked for in."""

    def __init__(self, record: TrialRecord):
        self.record, self.log, self.result = record, record.log, record.result
        self.suspects = suspects_of(record)

    @cached_property
    def moments(self) -> LastMoments | None:
        """The last seconds; None where the log does not tell what was asked."""
        if self.record.robot is None or not self.record.tells_what_was_asked:
            return None
        return moments_of(self.log, self.record.robot, self.record.terrain)

    @cached_property
    def events(self) -> list[Event]:
        """All events of the last seconds."""
        return [] if self.moments is None else events_of(self.moments)

    @cached_property
    def chain(self) -> list[Event]:
        """Those that led to the end."""
        return chain_of(self.events, self.end)

    @property
    def end(self) -> float:
        """Of the trial [s]."""
        return float(self.log["time"][-1]) if len(self.log) else self.result.sim_time

    @property
    def begin(self) -> float:
        """When the chain that led to the end begins [s]; without one, the end."""
        return self.chain[0].time if self.chain else self.end

    @property
    def fell(self) -> bool:
        """Whether the robot itself came to grief, rather than its plans."""
        return self.result.reason in ("fell", "left_terrain")

    def notes(self, *sources: str) -> Iterator[tuple[float, str]]:
        """(time [s], text) of what these said."""
        said = (self.log.get(f"note_{name}", ()) for name in ("time", "source", "text"))
        for time, source, text in zip(*said, strict=True):
            if source in sources:
                yield float(time), str(text)

    def position(self, time: float) -> np.ndarray:
        """Of the base at ``time`` [s], in W [m], (3,)."""
        k = min(int(np.searchsorted(self.log["time"], time)), len(self.log["time"]) - 1)
        return self.log["p_WB"][k]
