"""Many trials by several processes, each result kept as soon as it is there: what has been computed is never lost."""

import json
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.progress import track

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json

_JOBS_PER_PROCESS = 8
"""A diagram with systems in Python is never quite freed (some 30 MB each); after so many jobs a process is replaced."""


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


def run_study(jobs: dict[str, Callable], store: Path, results: dict, *, workers: int, description: str) -> dict:
    """Runs ``jobs`` and writes their results into ``store`` (JSON) one by one.

    Args:
        jobs: by key what to call; must pickle.
        store: the file.
        results: those of earlier runs, by key; they are kept, and replaced where a job has the same key.
        workers: processes at the same time.
        description: for the progress bar.

    Returns: all results. A job that ends in a UserInputError has none, its message is printed.
    """
    console = Console(stderr=True)
    results = dict(results)
    context = get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context, max_tasks_per_child=_JOBS_PER_PROCESS) as pool:
        running = {pool.submit(job): key for key, job in jobs.items()}
        for job in track(as_completed(running), description, total=len(running), console=console):
            try:
                results[running[job]] = job.result()
            except UserInputError as error:
                console.print(f"{running[job]}: {error}", highlight=False)
                continue
            temporary = store.with_suffix(".part")
            temporary.write_text(json.dumps(results, indent=1), encoding="utf-8")
            temporary.replace(store)
    return results
