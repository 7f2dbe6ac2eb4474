"""Who owns the time of a simulation, and how calls are counted."""

import sys

import pytest
from numba import njit
from pyinstrument.frame import Frame

from quadpips_drake.trials.profiling import simulation_profiler
from quadpips_drake.trials.profiling.simulation_profiler import (
    DRAKE,
    LOG,
    OTHER,
    PORTS,
    RENDERING,
    CallCounts,
    SimulationProfiler,
)

STAGE, PORT = "quadpips_drake/framework/stage.py", "quadpips_drake/framework/ports.py"
MPC, SOLVER = "quadpips_drake/control/mpc/centroidal_mpc_system.py", "quadpips_drake/solvers/piqp_solver.py"
EYE = "quadpips_drake/perception/normals/normal_estimator_system.py"
TRIAL = "quadpips_drake/trials/simulated_trial.py"


def tree(*path, time):
    """A chain of frames (function, file) that all last ``time`` [s]; the innermost one does all the work."""
    frame = None
    for function, file in reversed(path):
        frame = Frame(f"{function}\0{file}\0001", [] if frame is None else [frame], time=time)
    return frame


@pytest.mark.parametrize(
    ("path", "owner"),
    [
        ([("run", TRIAL)], DRAKE),
        ([("run", TRIAL), ("PyCapsule.AdvanceTo", "<built-in>")], DRAKE),
        ([("run", TRIAL), ("_timed", STAGE)], PORTS),
        ([("run", TRIAL), ("_timed", STAGE), ("update", MPC)], "centroidal mpc"),
        ([("run", TRIAL), ("_timed", STAGE), ("update", MPC), ("solve", SOLVER)], "centroidal mpc"),
        ([("run", TRIAL), ("_timed", STAGE), ("update", MPC), ("read", STAGE)], PORTS),
        ([("update", MPC), ("read", STAGE), ("PyCapsule.Eval", "<built-in>")], DRAKE),
        ([("update", MPC), ("read", STAGE), ("update", EYE), ("estimate", "normals.py")], "normal estimator"),
        ([("update", EYE), ("read", STAGE), ("PyCapsule.Eval", "<built-in>")], RENDERING),
        ([("run", TRIAL), ("sample", "quadpips_drake/trials/trial.py"), ("append", "trial_log.py")], LOG),
        ([("run", TRIAL), ("sample", "quadpips_drake/trials/trial.py"), ("write", PORT)], PORTS),
        ([("run", TRIAL), ("both", "progress.py")], OTHER),
    ],
)
def test_time_has_one_owner(path, owner):
    seconds = {}
    simulation_profiler._add_own_time(tree(*path, time=2.0), (), seconds)
    assert {name: time for name, time in seconds.items() if time > 0.0} == {owner: 2.0}


def test_all_time_is_filed_once():
    root = tree(("run", TRIAL), ("_timed", STAGE), ("update", MPC), time=3.0)
    root.add_child(tree(("sample", "trials/trial.py"), time=0.5))
    root.time = 4.0
    seconds = {}
    simulation_profiler._add_own_time(root, (), seconds)
    assert seconds == {DRAKE: 0.5, LOG: 0.5, "centroidal mpc": 3.0, PORTS: 0.0}


def called():
    """Called so often in each window."""


def test_calls_are_counted_in_their_windows():
    profiler = SimulationProfiler()
    with profiler:
        for tick in range(26):
            profiler.tick(0.1 * tick)
            called()
    assert profiler.counts.sim_time == pytest.approx(0.3), "after 0.1, 1.1 and 2.1 s"
    assert profiler.sampled_sim_time == pytest.approx(2.2)
    found = {name: calls for name, calls in profiler.counts.most_called(9) if name.startswith("called ")}
    assert list(found.values()) == [pytest.approx(10.0)]
    assert profiler.counts.per_second()["python"] >= 10.0


def test_nothing_is_said_of_calls_that_were_not_counted():
    assert CallCounts().per_second() == {} and CallCounts().most_called(5) == []


def test_a_profiler_that_ends_while_it_counts_leaves_none_behind():
    profiler = SimulationProfiler()
    with profiler:
        profiler.tick(0.0)
        profiler.tick(0.1)
    assert sys.getprofile() is None
    assert profiler.counts.sim_time == 0.0


@njit
def busy(n):
    total = 0.0
    for k in range(n):
        total += (k % 7) ** 0.5
    return total


def caller_of_a_kernel():
    return busy(30_000_000)


def test_kernels_are_found_below_their_callers():
    busy(1)
    profiler = SimulationProfiler()
    with profiler:
        caller_of_a_kernel()
    root = profiler._sampler.last_session.root_frame(trim_stem=False)

    def chains(frame, above=()):
        path = (*above, frame.function)
        return [path, *(chain for child in frame.children for chain in chains(child, path))]

    kernels = [chain for chain in chains(root) if chain[-1] == "busy"]
    assert kernels and all("caller_of_a_kernel" in chain for chain in kernels)
