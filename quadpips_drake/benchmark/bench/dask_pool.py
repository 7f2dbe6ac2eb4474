"""The trials of a bench by the workers of a Dask cluster (an optional dependency: ``pip install .[dask]``)."""

from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from uuid import uuid4

from quadpips_drake.errors import UserInputError
from quadpips_drake.worker_pool import JobFailed, Outcome

CONNECT_TIMEOUT = 20.0
"""How long to look for the scheduler [s]."""


class DaskPool:
    """A cluster that does one trial on each of its workers.

    A worker that dies is replaced by its nanny, and its trial given to another one, as often as the scheduler allows
    (``distributed.scheduler.allowed-failures``). Then it is handed in once more, as by ``ProcessPool``.
    """

    def __init__(self, address: str):
        """Args: of the scheduler, such as tcp://host:8786.

        Raises:
            UserInputError: Dask is not installed, or nothing answers there that could run a trial.
        """
        try:
            from distributed import Client
        except ImportError:
            raise UserInputError("--scheduler needs Dask; install it: pip install 'quadpips_drake[dask]'") from None
        try:
            self._client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
        except (OSError, ValueError) as error:  # TimeoutError too
            why = " ".join(str(error).split()) or type(error).__name__
            raise UserInputError(f"--scheduler {address}: no Dask scheduler answers there ({why})") from None
        self.address = address

    def __enter__(self) -> "DaskPool":
        return self

    def __exit__(self, *_):
        self._client.close()

    def check(self) -> int:
        """The number of workers.

        Raises:
            UserInputError: there are none, one runs several trials in one process, or one has another version of ours.
        """
        from quadpips_drake.trials.result import installed_versions

        workers = self._client.scheduler_info(n_workers=-1)["workers"]
        if not workers:
            raise UserInputError(f"--scheduler {self.address}: it has no workers; start some: dask worker {self.address}")
        if any(worker["nthreads"] != 1 for worker in workers.values()):
            raise UserInputError(
                f"--scheduler {self.address}: its workers have several threads; start them with --nthreads 1 --nworkers N"
            )
        try:
            theirs = self._client.run(installed_versions)
        except Exception as error:  # whatever importing our package raises there
            raise UserInputError(
                f"--scheduler {self.address}: a worker has no quadpips_drake ({type(error).__name__}: {error})"
            ) from None
        ours = installed_versions()
        for worker, versions in theirs.items():
            if versions != ours:
                name = next(name for name in ours if versions.get(name) != ours[name])
                raise UserInputError(
                    f"--scheduler {self.address}: {worker} has {name} {versions.get(name)}, here is {ours[name]}; "
                    "results would not be the same"
                )
        return len(workers)

    def run(self, jobs: dict[str, Callable], told: Callable[[str], None]) -> Iterator[Outcome]:
        """Yields the outcome of each job once; see ``ProcessPool.run``."""
        from distributed import as_completed

        run = uuid4().hex  # keys are the whole cluster's: another bench must not get our results
        waiting, futures, deaths = deque(jobs), {}, Counter()
        running = as_completed(loop=self._client.loop)
        try:
            while waiting or futures:
                # One for each worker and no more: what waits at a worker that dies would count as having died with it.
                while waiting and len(futures) < max(self._workers(), 1):
                    key = waiting.popleft()
                    future = self._client.submit(jobs[key], key=f"{key}-{run}-{deaths[key]}")
                    futures[future] = key
                    running.add(future)
                done = next(running)
                outcome = _outcome(futures.pop(done), done)
                done.release()  # a recording of some megabytes
                if isinstance(outcome.error, JobFailed) and not deaths[outcome.key]:
                    told(f"{outcome.key}: {outcome.error}; it is tried once more")
                    waiting.append(outcome.key)
                    deaths[outcome.key] += 1
                else:
                    yield outcome
        finally:
            with suppress(Exception):  # the scheduler may have gone
                self._client.cancel(list(futures), force=True)

    def _workers(self) -> int:
        return len(self._client.scheduler_info(n_workers=-1)["workers"])


def _outcome(key: str, future) -> Outcome:
    """That of a job that is over."""
    from distributed.scheduler import KilledWorker

    try:
        return Outcome(key, future.result())
    except KilledWorker:
        return Outcome(key, error=JobFailed("the Dask workers that tried it ended abruptly"))
    except Exception as error:
        return Outcome(key, error=error)
