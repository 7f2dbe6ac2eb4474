"""Many jobs by several processes, for whatever takes long: each outcome is handed over as soon as it is there.

The pools of the standard library do not do for hours of simulation: ``ProcessPoolExecutor(max_tasks_per_child=...)`` waits
for ever once its workers have had their share of jobs (Python 3.11 to 3.13), ``multiprocessing.Pool`` waits for ever for a
job whose worker was killed, and the workers of both outlive a parent that ends by force. Here each worker is a process at
the end of a pipe of its own, so that its end is seen, and it watches for the end of its parent.
"""

import ctypes
import math
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Hashable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process
from typing import Any

JOBS_PER_PROCESS = 8
"""After so many jobs a process is replaced, whatever they have left in it: systems of other packages may never be freed."""
_FAREWELL = 1.0
"""How long a worker that has nothing more to do may take to end by itself [s]."""
_PR_SET_PDEATHSIG = 1
"""Of prctl(2): which signal a process gets when its parent ends."""


class JobFailed(Exception):
    """A job that has no result for a reason that is no exception of its own: its process ended, its result cannot travel."""


@dataclass(frozen=True)
class Outcome:
    """How one job ended."""

    key: Hashable
    value: Any = None
    error: BaseException | None = None
    """What the job raised, or JobFailed; None when ``value`` is its result."""


def available_cores() -> int:
    """Processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_jobs(
    jobs: dict[Hashable, Callable[[], Any]],
    *,
    workers: int,
    jobs_per_process: int = JOBS_PER_PROCESS,
    time_limit: float | None = None,
    following: Callable[[Outcome], dict] = lambda outcome: {},
) -> Iterator[Outcome]:
    """Runs ``jobs`` and yields an Outcome for each, in the order in which they end.

    Whatever ends this generator (the last job, ``close()``, Ctrl-C) ends the workers at once; what was yielded until then
    is the caller's. A job whose worker dies fails alone, another worker does the rest.

    Args:
        jobs: by key what to call; they and their results must pickle.
        workers: processes at the same time.
        jobs_per_process: after so many jobs a process is replaced by a fresh one.
        time_limit: a job that takes longer [s] fails, and its process is ended; None: jobs may take as long as they like.
        following: called with each outcome; returns further jobs.
    """
    waiting, crew = deque(jobs.items()), []
    try:
        while waiting or crew:
            while waiting and len(crew) < workers:
                crew.append(_Worker(math.inf if time_limit is None else time_limit))
                crew[-1].begin(*waiting.popleft())
            ready = connection.wait([worker.pipe for worker in crew], _timeout(crew))
            for worker in crew:
                if worker.pipe not in ready and worker.patience() <= 0.0:
                    worker.give_up()
                    ready.append(worker.pipe)
            for worker in [worker for worker in crew if worker.pipe in ready]:
                outcome = worker.outcome()
                waiting.extend(following(outcome).items())
                if waiting and worker.alive and worker.jobs < jobs_per_process:
                    worker.begin(*waiting.popleft())
                else:
                    crew.remove(worker)
                    worker.dismiss()
                yield outcome
    finally:
        for worker in crew:
            worker.process.kill()
        for worker in crew:
            worker.process.join()


def results_of(jobs: dict[Hashable, Callable[[], Any]], *, workers: int, what: str) -> Iterator[Any]:
    """Runs ``jobs`` and yields the result of each, in the order in which they end; whatever a job raises ends them all.

    Args:
        jobs: as for ``run_jobs``.
        workers: processes at the same time; 0: the jobs are done in this process, one after the other.
        what: what a job makes, in the plural, for the message.

    Raises:
        JobFailed: at the end, when jobs have no result because their processes ended.
    """
    lost, here = [], (Outcome(key, job()) for key, job in jobs.items())
    with closing(run_jobs(jobs, workers=workers) if workers else here) as outcomes:
        for outcome in outcomes:
            if isinstance(outcome.error, JobFailed):
                lost.append(f"{outcome.key}: {outcome.error}")
            elif outcome.error is not None:
                raise outcome.error
            else:
                yield outcome.value
    if lost:
        raise JobFailed(f"{len(lost)} of {len(jobs)} {what} are missing ({lost[0]})")


def _timeout(crew: list["_Worker"]) -> float | None:
    """How long to wait for the crew at most [s]; None: for ever."""
    patience = min(worker.patience() for worker in crew)
    return patience if patience < math.inf else None


class _Worker:
    """A process that does one job after the other, seen from its parent."""

    def __init__(self, time_limit: float):
        """Args: how long a job may take [s]."""
        # Started afresh: VTK and its EGL context do not survive a fork.
        context = get_context("spawn")
        self.pipe, other_end = context.Pipe()
        self.process = context.Process(target=_serve, args=(other_end,), daemon=True)
        with _without_interruption():
            self.process.start()
        other_end.close()
        self.alive = True
        self.jobs = 0
        """Begun so far."""
        self._key = None
        self._time_limit = time_limit
        self._began = time.monotonic()
        self._gave_up = False

    def begin(self, key, job) -> None:
        """Hands over the next job."""
        self._key = key
        self._began = time.monotonic()
        self.jobs += 1
        with suppress(OSError):  # where it has just died, ``outcome`` will say so
            self.pipe.send(job)

    def patience(self) -> float:
        """How much longer the present job may take [s]."""
        return max(0.0, self._began + self._time_limit - time.monotonic())

    def give_up(self) -> None:
        """Ends the process, whose job has taken too long."""
        self._gave_up, self.alive = True, False
        self.process.kill()

    def outcome(self) -> Outcome:
        """That of the job that was begun last; waits for it."""
        try:
            value, error = self.pipe.recv()
        except (EOFError, OSError):
            self.alive = False
            self.process.join()
            took_too_long = f"it took longer than {self._time_limit:g} s, and its process was ended" if self._gave_up else ""
            value, error = None, JobFailed(took_too_long or _cause_of_death(self.process.exitcode))
        return Outcome(self._key, value, error)

    def dismiss(self) -> None:
        """Lets the process end, and sees to it that it does."""
        self.pipe.close()
        self.process.join(_FAREWELL)
        self.process.kill()
        self.process.join()


def _cause_of_death(exit_code: int) -> str:
    if exit_code >= 0:
        return f"its process ended abruptly (exit status {exit_code})"
    try:
        name = signal.Signals(-exit_code).name
    except ValueError:
        name = f"signal {-exit_code}"
    return f"its process ended abruptly ({name}{'; out of memory?' if name == 'SIGKILL' else ''})"


@contextmanager
def _without_interruption():
    """What is started meanwhile does not hear Ctrl-C: the terminal sends it to all processes, the parent alone answers."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe) -> None:
    """The worker's side: jobs come through ``pipe`` until it is closed, pairs of result and exception go back."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    _end_with_parent()
    while True:
        try:
            job = pipe.recv_bytes()
        except (EOFError, OSError):
            return
        answer = _do(job)
        try:
            pipe.send_bytes(answer)
        except OSError:
            return


def _do(job: bytes) -> bytes:
    """Does a pickled job; returns the pickled pair of its result and its exception."""
    try:
        return pickle.dumps((pickle.loads(job)(), None))
    except BaseException as error:  # SystemExit too: that is how some of Drake's assertions arrive
        error.add_note("".join(traceback.format_exception(error)))
        try:
            answer = pickle.dumps((None, error))
            pickle.loads(answer)  # not every exception that pickles comes out again
        except Exception:
            answer = pickle.dumps((None, JobFailed(f"{type(error).__name__}: {error}")))
        return answer
    finally:
        sys.stdout.flush()
        sys.stderr.flush()


def _end_with_parent() -> None:
    """Lets this process end when its parent does, whatever ends that."""
    if sys.platform == "linux":
        # At once, even in the middle of compiled code. It goes by the thread that started this process.
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    # Everywhere, also where the parent has ended before this line: its end of a pipe closes with it.
    parent = parent_process()

    def watch():
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="watch of the parent").start()
