"""The pool behind studies, datasets and checks: every job has an outcome, and no process is left behind."""

import os
import re
import signal
import subprocess
import sys
import time
from functools import partial

import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.worker_pool import JobFailed, run_jobs
from tests import trivial_jobs
from tests.source_tree import ROOT, files

PATIENCE = 60.0
"""How long a test waits for something that has to happen before it fails [s]."""


@pytest.mark.parametrize("workers", [1, 2])
def test_more_jobs_than_a_process_may_do_all_end(workers):
    jobs = {f"job {k}": partial(trivial_jobs.process_id, k) for k in range(19)}
    outcomes = list(run_jobs(jobs, workers=workers))
    assert {outcome.key: outcome.value[0] for outcome in outcomes} == {f"job {k}": k for k in range(19)}
    per_process = [outcome.value[1] for outcome in outcomes]
    assert max(per_process.count(process) for process in per_process) <= 8
    assert os.getpid() not in per_process


def test_no_jobs_need_no_processes():
    assert list(run_jobs({}, workers=2)) == []


def test_a_job_whose_process_is_killed_fails_alone():
    jobs = {0: partial(round, 0.6), 1: trivial_jobs.end_by_force, 2: partial(round, 2.6), 3: partial(round, 3.6)}
    outcomes = {outcome.key: outcome for outcome in run_jobs(jobs, workers=1)}
    assert [outcomes[key].value for key in range(4)] == [1, None, 3, 4]
    assert isinstance(outcomes[1].error, JobFailed) and "SIGKILL" in str(outcomes[1].error)


def test_a_job_that_takes_too_long_fails_alone(tmp_path):
    jobs = {0: partial(trivial_jobs.hang, tmp_path), 1: partial(round, 1.6), 2: partial(round, 2.6)}
    outcomes = {outcome.key: outcome for outcome in run_jobs(jobs, workers=1, time_limit=PATIENCE / 20.0)}
    assert isinstance(outcomes[0].error, JobFailed) and "took longer than 3 s" in str(outcomes[0].error)
    assert [outcomes[key].value for key in (1, 2)] == [2, 3]


def test_what_a_job_raises_is_its_outcome():
    jobs = {
        "our own": partial(exec, "from quadpips_drake.errors import *; raise UserInputError('wrong')"),
        "another": partial(int, "x"),
        "an exit": partial(sys.exit, 3),
        "an exception that cannot travel": trivial_jobs.refuse,
        "a result that cannot travel": partial(eval, "lambda: 0"),
        "fine": partial(round, 1.6),
    }
    errors = {outcome.key: outcome.error for outcome in run_jobs(jobs, workers=1)}
    assert isinstance(errors["our own"], UserInputError) and str(errors["our own"]) == "wrong"
    assert isinstance(errors["another"], ValueError) and "Traceback" in errors["another"].__notes__[0]
    assert isinstance(errors["an exit"], SystemExit)
    assert isinstance(errors["an exception that cannot travel"], JobFailed)
    assert str(errors["an exception that cannot travel"]) == "UnportableError: one and two"
    assert errors["a result that cannot travel"] is not None
    assert errors["fine"] is None


def test_jobs_can_follow_from_outcomes():
    def halved(outcome):
        return {outcome.value // 2: partial(round, outcome.value // 2)} if outcome.value > 1 else {}

    outcomes = run_jobs({20: partial(round, 20)}, workers=2, following=halved)
    assert [outcome.value for outcome in outcomes] == [20, 10, 5, 2, 1]


def test_a_caller_that_has_enough_leaves_no_process_behind(tmp_path):
    outcomes = run_jobs({0: partial(round, 0.6), 1: partial(trivial_jobs.hang, tmp_path)}, workers=2)
    assert next(outcomes).value == 1
    processes = wait_for_processes(tmp_path, 1)
    outcomes.close()
    wait_for_ends(processes)


@pytest.mark.parametrize("job", ["hang", "hang_without_kernel_watch"])
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_their_parent_whatever_ends_it(ending, job, tmp_path):
    parent = start_study(job, tmp_path)
    processes = wait_for_processes(tmp_path, 2)
    if ending == signal.SIGINT:
        os.killpg(parent.pid, ending)  # as a terminal does: everyone gets it
    else:
        parent.send_signal(ending)
    errors = parent.communicate(timeout=PATIENCE)[1]
    assert parent.returncode != 0
    wait_for_ends(processes)
    assert '"quick": 3' in (tmp_path / "results" / "some.json").read_text()
    if ending == signal.SIGINT:
        assert errors.count("Traceback") == 1, "the parent's own, which the command line turns into an exit status"
        assert re.search(r"interrupted; the results of 1 of 3 jobs are kept in .*some\.json", " ".join(errors.split()))


def start_study(job, folder):
    """Starts a study of one quick job and two that hang; returns its process, the leader of a group of its own."""
    (folder / "results").mkdir()
    code = f"""
from functools import partial
from pathlib import Path
from quadpips_drake.benchmark.study_pool import run_study
from tests import trivial_jobs
slow = partial(trivial_jobs.{job}, Path({str(folder)!r}))
jobs = {{"quick": partial(round, 2.7), "first": slow, "second": slow}}
run_study(jobs, Path({str(folder / "results" / "some.json")!r}), {{}}, workers=2, description="jobs")
"""
    return subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, start_new_session=True, text=True, stderr=subprocess.PIPE
    )


def wait_for_processes(folder, count) -> list[int]:
    """Waits until ``count`` jobs have noted their process in ``folder``; returns the processes."""
    return eventually(
        lambda: [int(path.name) for path in folder.iterdir() if path.is_file()], lambda found: len(found) == count
    )


def wait_for_ends(processes) -> None:
    """Waits until none of the processes is there."""
    eventually(lambda: [process for process in processes if is_alive(process)], lambda alive: not alive)


def is_alive(process: int) -> bool:
    """Whether a process is there and has not ended (one that nobody has waited for yet has)."""
    try:
        with open(f"/proc/{process}/stat", encoding="utf-8") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def eventually(value, condition):
    """Returns ``value()`` as soon as it fulfils the condition."""
    deadline = time.monotonic() + PATIENCE
    while not condition(found := value()):
        assert time.monotonic() < deadline, found
        time.sleep(0.02)
    return found


def test_there_is_one_pool():
    others = [
        str(path.relative_to(ROOT))
        for path in files("*.py")
        if path.relative_to(ROOT).parts[0] in ("quadpips_drake", "diagrams") and path.name != "worker_pool.py"
        # Threads are another matter: ``framework/background.py`` has those.
        if re.search(r"^\s*(from|import) multiprocessing|ProcessPoolExecutor", path.read_text(encoding="utf-8"), re.M)
    ]
    assert not others
