"""A bench on a Dask cluster: two workers of this machine."""

import gc
from functools import partial

import pytest

from quadpips_drake.benchmark.bench.bench import JOURNAL, rows_of, run_missing
from quadpips_drake.benchmark.bench.dask_pool import DaskPool
from quadpips_drake.benchmark.bench.journal import Journal
from quadpips_drake.benchmark.bench.settings import BenchSettings, Course
from quadpips_drake.errors import UserInputError
from tests.benchmark.bench import fake_trials
from tests.benchmark.bench.fake_trials import SETTINGS, fake_row
from tests.benchmark.bench.test_bench import Listener
from tests.test_worker_pool import PATIENCE

dask = pytest.importorskip("dask", reason="Dask is not installed: pip install .[dask]")
distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install .[dask]")


@pytest.fixture(scope="module")
def cluster():
    """Two workers, each a process of one thread; the scheduler gives a trial to two of them at most."""
    options = {"distributed.scheduler.allowed-failures": 1, "distributed.worker.daemon": True}
    with (
        dask.config.set(options),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", protocol="tcp") as found,
    ):
        yield found


def run_on(cluster, folder, run, settings=SETTINGS):
    """Runs all trials; returns the rows and what was told."""
    listener = Listener()
    with distributed.Client(cluster, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=PATIENCE)  # one may be starting again after a test before
    with DaskPool(cluster.scheduler_address) as pool, Journal(folder / JOURNAL) as journal:
        assert pool.check() == 2
        run_missing(settings, journal, pool, listener, run)
        return rows_of(settings, journal.entries), listener


def test_a_cluster_gives_the_same_table(cluster, tmp_path):
    rows, listener = run_on(cluster, tmp_path, fake_trials.quick)
    assert rows == [fake_row(spec) for spec in SETTINGS.trial_specs()]
    assert len(listener.rows) == 12
    assert run_on(cluster, tmp_path, fake_trials.refused)[1].rows == [], "nothing is left to do"


def test_errors_on_a_cluster_are_rows(cluster, tmp_path):
    rows, _ = run_on(cluster, tmp_path, fake_trials.refused)
    details = {row["seed"]: row["detail"] for row in rows if row["reason"] == "error"}
    assert details == {5: "there is no ground under the start", 6: "ZeroDivisionError: float division by zero"}


@pytest.mark.parametrize("terrain", ["ramp_10", "stairs"])
def test_a_trial_that_kills_its_worker_is_run_again_but_not_for_ever(cluster, tmp_path, terrain):
    notes = tmp_path / "notes"
    notes.mkdir()
    settings = BenchSettings(courses=[Course("anymal_c", terrain)], trials=3, seed=4)
    rows, listener = run_on(cluster, tmp_path, partial(fake_trials.deadly, notes), settings)
    assert [row["reason"] for row in rows[1:]] == ["goal_reached", "fell"]
    begun = (notes / f"anymal_c-{terrain}-quadpips-4").read_text().count("\n")
    if terrain == "ramp_10":
        assert (rows[0]["reason"], begun, listener.lines) == ("goal_reached", 2, [])
    else:
        assert rows[0]["reason"] == "error" and "ended abruptly" in rows[0]["detail"]
        assert (begun, len(listener.lines)) == (4, 1), "each time the scheduler allows two attempts"


def test_a_scheduler_that_is_not_there_is_told(monkeypatch):
    monkeypatch.setattr("quadpips_drake.benchmark.bench.dask_pool.CONNECT_TIMEOUT", 0.5)
    for address in ("tcp://127.0.0.1:1", "nowhere:at:all"):
        with pytest.raises(UserInputError, match="no Dask scheduler answers there"):
            DaskPool(address)
    # The client that came to nothing goes now: collected while a cluster starts, it would wait for its lock for ever.
    gc.collect()


def test_workers_of_several_threads_are_refused():
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=":0") as found,
        DaskPool(found.scheduler_address) as pool,
        pytest.raises(UserInputError, match="--nthreads 1"),
    ):
        pool.check()
