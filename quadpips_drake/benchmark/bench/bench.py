"""A bench: many trials, each entered into a journal as soon as it is over, resumable whatever ended it."""

from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Protocol

from quadpips_drake.benchmark.bench.journal import Journal, read_journal
from quadpips_drake.benchmark.bench.rows import BenchTrial, row_without_trial
from quadpips_drake.benchmark.bench.settings import (
    SETTINGS,
    BenchSettings,
    TrialSpec,
    first_difference,
    load_settings,
    save_settings,
)
from quadpips_drake.errors import UserInputError, one_line
from quadpips_drake.worker_pool import JobFailed, Outcome

JOURNAL = "trials.jsonl"
"""The journal of the trials, in the folder of a bench."""

RunTrial = Callable[..., BenchTrial]
"""(spec, settings, record=False) -> what came out; must pickle. Usually ``run_bench_trial``."""


class Pool(Protocol):
    """Who runs the trials."""

    def run(self, jobs: dict[str, Callable], told: Callable[[str], None]) -> Iterator[Outcome]:
        """Yields an Outcome for each job, see ``ProcessPool.run``."""


class Onlooker(Protocol):
    """Who is told how far a bench is."""

    def note(self, row: dict) -> None:
        """A trial is over."""

    def tell(self, text: str) -> None:
        """Something happened that the user should know."""


def claim(settings: BenchSettings, folder: Path, *, resume: bool) -> None:
    """Takes ``folder`` for a bench with these settings: writes them there, or finds the same ones.

    Settings of a bench of which no trial is over are replaced.

    Raises:
        UserInputError: the folder holds another bench, or this one and it is not to be resumed.
    """
    found, done = load_settings(folder), len(read_journal(folder / JOURNAL)[0])
    if found is None and (folder / JOURNAL).exists():
        raise UserInputError(f"--out {folder}: holds {JOURNAL} without {SETTINGS}; give another directory")
    if not done:
        save_settings(settings, folder)
        return
    difference = first_difference(settings, found)
    if difference:
        raise UserInputError(f"--out {folder}: holds a bench with other settings ({difference}); give another directory")
    if not resume:
        raise UserInputError(
            f"--out {folder}: holds this bench already, {done} of {len(settings.trial_specs())} trials; "
            "add --resume to go on with it, or give another directory"
        )


def run_missing(
    settings: BenchSettings,
    journal: Journal,
    pool: Pool,
    onlooker: Onlooker,
    run: RunTrial,
    record: Callable[[TrialSpec, BenchTrial], None] | None = None,
) -> None:
    """Runs the trials that the journal has no entry of, and enters them one by one.

    Where ``record`` is given all trials are recorded, and it is called with each before its entry is made.

    Whatever ends this early leaves all entries that the onlooker was told of. A trial that has no result, because it cannot
    be built or its process died twice, is entered with the reason "error".
    """
    specs = {spec.key: spec for spec in settings.trial_specs() if spec.key not in journal.entries}
    options = {} if record is None else {"record": True}
    jobs = {key: partial(run, spec, settings, **options) for key, spec in specs.items()}
    with closing(pool.run(jobs, onlooker.tell)) as outcomes:
        for outcome in outcomes:
            row = outcome.value.row if outcome.error is None else row_without_trial(specs[outcome.key], why(outcome.error))
            if record is not None and outcome.error is None:
                record(specs[outcome.key], outcome.value)
            journal.append(outcome.key, row)
            onlooker.note(row)


def rows_of(settings: BenchSettings, entries: dict[str, dict], more: dict[str, dict] | None = None) -> list[dict]:
    """The rows of a journal in the order of the settings, whatever order the trials ended in.

    ``more``: by the same keys, what else there is to say of some of them.
    """
    more = more or {}
    return [{**entries[spec.key], **more.get(spec.key, {})} for spec in settings.trial_specs() if spec.key in entries]


def why(error: BaseException) -> str:
    """What an exception says, in one line."""
    text = one_line(" ".join(str(error).split()))
    return text if isinstance(error, UserInputError | JobFailed) and text else f"{type(error).__name__}: {text}".rstrip(": ")
