"""Many trials by several processes, each result kept as soon as it is there: what has been computed is never lost."""

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json, write_json
from quadpips_drake.worker_pool import JOBS_PER_PROCESS, JobFailed, Outcome, run_jobs


@dataclass
class Study:
    """What has come out of the jobs of a study."""

    results: dict
    """By key; earlier ones too."""
    failed: list[str] = field(default_factory=list)
    """Keys of the jobs of this run that have no result."""


def load_results(store: Path) -> dict:
    """The results in ``store``; none if there is no such file. Raises UserInputError when it cannot be read."""
    if not store.exists():
        return {}
    try:
        results = read_json(store)
    except UserInputError as error:
        raise UserInputError(f"{error}; remove it or choose another --out") from None
    if not isinstance(results, dict):
        raise UserInputError(f"{store} is no file of results; remove it or choose another --out")
    return results


def _put(results: dict, key: str, value) -> dict:
    results[key] = value
    return {}


def run_study(
    jobs: dict[str, Callable],
    store: Path,
    results: dict,
    *,
    workers: int,
    description: str,
    keep: Callable = _put,
    jobs_per_process: int = JOBS_PER_PROCESS,
) -> Study:
    """Runs ``jobs`` and writes their results into ``store`` (JSON) one by one, so that an interruption loses none of them.

    Args:
        jobs: by key what to call; must pickle.
        store: the file.
        results: those of earlier runs, by key; they are kept, and replaced where a job has the same key.
        workers: processes at the same time.
        description: for the progress bar.
        keep: (results, key of a job, its result) -> further jobs that follow from it; puts the result among ``results``.
        jobs_per_process: after so many jobs a process is replaced by a fresh one.

    Returns: the results. For a job that raised something, or whose process died, one line is printed, and the rest goes on.
    """
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    study, total, done = Study(dict(results)), len(jobs), 0

    def following(outcome: Outcome) -> dict:
        nonlocal total, done
        if outcome.error is not None:
            console.print(f"{outcome.key}: {_one_line(outcome.error)}", markup=False)
            study.failed.append(outcome.key)
            return {}
        further = keep(study.results, outcome.key, outcome.value)
        write_json(store, study.results)
        total, done = total + len(further), done + 1
        return further

    try:
        with Progress(*Progress.get_default_columns(), console=console) as progress:
            bar = progress.add_task(description, total=total)
            running = run_jobs(jobs, workers=workers, jobs_per_process=jobs_per_process, following=following)
            with closing(running) as outcomes:
                for _ in outcomes:
                    progress.update(bar, advance=1, total=total)
    except KeyboardInterrupt:
        console.print(f"interrupted; the results of {done} of {total} jobs are kept in {store}", markup=False)
        raise
    return study


def _one_line(error: BaseException) -> str:
    """What was the matter, for the user."""
    text = " ".join(str(error).split())
    return text if isinstance(error, UserInputError | JobFailed) and text else f"{type(error).__name__}: {text}".rstrip(": ")
