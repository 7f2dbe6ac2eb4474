"""The post-mortem of a failed trial: what came first, what followed, where to look, how to see it again."""

import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from quadpips_drake.trials.explaining.first_events import Event
from quadpips_drake.trials.reporting.case import Case, Finding
from quadpips_drake.trials.reporting.causes import body, contact, control, way
from quadpips_drake.trials.reporting.last_seconds import what_happened, what_was_asked
from quadpips_drake.trials.reporting.trial_record import CONFIG, TrialRecord

CAUSES: tuple[Callable[[Case], Iterator[Finding]], ...] = (
    way.blind,
    body.pushed,
    control.no_solution,
    way.blocked,
    way.hit_what_appeared,
    contact.slippery,
    body.loaded,
    control.late_policies,
    contact.wrong_height,
    contact.too_high,
    way.nothing_steppable,
    way.missed_ground,
    way.gave_up,
    body.too_weak,
    contact.obstructed,
    control.off_reference,
)
"""What is looked for. Each gives what it has measured, and a weight: how well that explains the end."""
EXAMINED = ("fell", "left_terrain", "no_plan", "timeout")
"""Reasons for which there is a post-mortem: an error of the program is another matter."""


@dataclass(frozen=True)
class PostMortem:
    """Of a trial that failed."""

    findings: tuple[Finding, ...]
    """The most likely one first; empty if nothing was found."""
    chain: tuple[Event, ...]
    """Events that led to the end, in order."""
    asked: tuple[str, ...]
    """What was asked in the last two seconds, in sentences."""
    happened: tuple[str, ...]
    """What the robot did in them."""
    command: str
    """That repeats the trial."""

    @property
    def first(self) -> Finding | None:
        """The first event of all, and where to look."""
        return self.findings[0] if self.findings else None


def post_mortem_of(record: TrialRecord) -> PostMortem | None:
    """Examines a trial; None for one that succeeded, was interrupted, broke off, or has left no log."""
    if record.result.success or record.result.reason not in EXAMINED or not len(record.log):
        return None
    case = Case(record)
    found = [finding for cause in CAUSES for finding in cause(case)]
    found.sort(key=lambda finding: (-finding.weight, finding.time))
    return PostMortem(
        findings=tuple(found),
        chain=tuple(case.chain),
        asked=tuple(what_was_asked(case)),
        happened=tuple(what_happened(case)),
        command=repeating(record.is_walk, record.folder),
    )


def repeating(walk: bool, folder: Path) -> str:
    """The command that repeats the trial in ``folder``: its configuration holds the seed."""
    config = shlex.quote(str(folder / CONFIG))
    return f"quadpips {'walk' if walk else 'run'} {config} --out {shlex.quote(str(folder) + '-again')}"
