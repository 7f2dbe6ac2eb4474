"""The trials of a bench by processes of this machine: one that dies is replaced, and its trial tried once more."""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass

from quadpips_drake.worker_pool import JobFailed, Outcome, run_jobs


@dataclass(frozen=True)
class ProcessPool:
    """Worker processes that do one trial after the other."""

    workers: int
    """Trials at the same time."""
    time_limit: float | None = None
    """A trial that computes for longer [s] counts as one whose process has died; None: none does."""

    def run(self, jobs: dict[str, Callable], told: Callable[[str], None]) -> Iterator[Outcome]:
        """Yields the outcome of each job once, in the order in which they end.

        Args:
            jobs: by key what to call; must pickle.
            told: called with a line for the user when a job is tried again.
        """
        deaths: Counter = Counter()

        def following(outcome: Outcome) -> dict:
            if not isinstance(outcome.error, JobFailed):
                return {}
            deaths[outcome.key] += 1
            return {outcome.key: jobs[outcome.key]} if deaths[outcome.key] == 1 else {}

        running = run_jobs(jobs, workers=self.workers, time_limit=self.time_limit, following=following)
        with closing(running) as outcomes:
            for outcome in outcomes:
                if isinstance(outcome.error, JobFailed) and deaths[outcome.key] == 1:
                    told(f"{outcome.key}: {outcome.error}; it is tried once more")
                else:
                    yield outcome
