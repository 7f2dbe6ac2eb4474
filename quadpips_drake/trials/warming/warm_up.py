"""Compiles all numerical kernels ahead, by several processes, so that no trial has to wait for one."""

from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from pickle import UnpicklingError

from quadpips_drake.compiling import are_warm, note_warm, remove_broken_kernels, remove_stale_kernels
from quadpips_drake.trials.warming import kernel_exercises
from quadpips_drake.worker_pool import Outcome, available_cores, run_jobs

EXERCISES: dict[str, Callable[[], None]] = {
    "optimal control": kernel_exercises.optimal_control,
    "perception": kernel_exercises.perception,
    "planning": kernel_exercises.planning,
    "whole-body control": kernel_exercises.whole_body_control,
    "robot and ground": kernel_exercises.robot_and_ground,
}
"""By the group of stages whose kernels they compile. What takes longest comes first: so all processes end together."""

Told = Callable[[list[str], int, int], None]
"""Called with the groups that are being compiled, how many are done, and how many there are in all."""


def cold_groups() -> list[str]:
    """Groups of kernels that have to be compiled: never before, or not since the source of a kernel changed."""
    return [group for group in EXERCISES if not are_warm(group)]


def warm_up(told: Told = lambda now, done, total: None, *, workers: int = 0) -> dict[str, BaseException]:
    """Compiles the cold groups. What cannot be compiled is left to whoever needs it first.

    Args:
        told: how far it is.
        workers: processes that do it; they end with this one, whatever ends it. 0: this process itself (a program whose main
            module does something when it is imported must not start others).

    Returns: what went wrong, by group.
    """
    groups, failures = cold_groups(), {}
    if not groups:
        return failures
    remove_stale_kernels()
    told(groups[: max(workers, 1)], 0, len(groups))
    waiting = list(groups)
    with closing(_by_processes(groups, workers) if workers else _here(groups)) as outcomes:
        for done, outcome in enumerate(outcomes, start=1):
            waiting.remove(outcome.key)
            if outcome.error is not None:
                failures[outcome.key] = outcome.error
            told(waiting[: max(workers, 1)], done, len(groups))
    return failures


def warm_up_in_parallel(told: Told) -> dict[str, BaseException]:
    """``warm_up`` with a process for each core."""
    return warm_up(told, workers=available_cores())


def _by_processes(groups: list[str], workers: int) -> Iterator[Outcome]:
    jobs = {group: partial(_compile, group) for group in groups}
    return run_jobs(jobs, workers=workers, jobs_per_process=len(jobs))


def _here(groups: list[str]) -> Iterator[Outcome]:
    for group in groups:
        try:
            yield Outcome(group, _compile(group))
        except (Exception, SystemExit) as error:  # SystemExit: a failed assertion of Drake's
            yield Outcome(group, error=error)


def _compile(group: str) -> None:
    """Has the kernels of a group compiled, and notes it."""
    try:
        EXERCISES[group]()
    except (EOFError, UnpicklingError):  # a damaged file in the cache, from when the disk was full, say
        if not remove_broken_kernels():
            raise
        EXERCISES[group]()
    note_warm(group)
