"""How long one tick of whole-body control takes, by method and solver, and where the time goes.

Not part of the tests; run with

    OPENBLAS_NUM_THREADS=1 pytest tests/benchmarks/bench_whole_body_control.py --benchmark-columns=min,median,rounds

The printed table is Markdown. ``before`` is everything up to the program (policy, contacts, dynamics, matrices), ``program``
its solution (for the hierarchy: all levels with their null spaces), ``after`` torques and set points; where the tasks
themselves are solved, ``before`` holds both. ``cold`` is the total when 32 MB of other data have been through the
processor's caches since the last tick, as the rest of a simulation does it.
OSQP and Clarabel are what a user of Drake would pick, through a MathematicalProgram that is built once and updated. Times
are processor times of the one thread, so that a shared machine does not spoil them.
"""

import time
from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.whole_body.robot_dynamics import RobotDynamics
from quadpips_drake.control.whole_body.task_space_inverse_dynamics import TaskSpaceInverseDynamics
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.whole_body_command import WholeBodyCommand
from tests.control.whole_body.plant_dynamics import PlantDynamics
from tests.control.whole_body.trotting import mid_trot

VARIANTS = {
    "weighted, piqp_direct (default)": {},
    "weighted, proxqp_dense": {"solver": "proxqp_dense"},
    "weighted, proxqp by MathematicalProgram": {"solver": "proxqp"},
    "weighted, piqp_dense by MathematicalProgram": {"solver": "piqp_dense"},
    "weighted, osqp by MathematicalProgram": {"solver": "osqp"},
    "weighted, clarabel by MathematicalProgram": {"solver": "clarabel"},
    "weighted with joint stops": {"joint_stops": True},
    "hierarchical": {"method": "hierarchical"},
    "hierarchical with joint stops": {"method": "hierarchical", "joint_stops": True},
}
TICKS = 400
_rows = []


class Stopwatch:
    """Adds up the time spent in functions that are wrapped with it."""

    def __init__(self):
        self.total = 0.0

    def wrap(self, function):
        def timed(*args):
            start = time.thread_time()
            result = function(*args)
            self.total += time.thread_time() - start
            return result

        return timed


@pytest.fixture(scope="module", autouse=True)
def table():
    yield
    print("\n\n| whole-body control of one tick, medians in ms | before | program | after | total | 95 % | cold |")
    print("|---|---|---|---|---|---|---|")
    for name, *times in _rows:
        print(f"| {name} | " + " | ".join(f"{1e3 * seconds:.3f}" for seconds in times) + " |")


def situations(robot):
    """Slightly different moments of a trot, as they follow each other."""
    state, policy = mid_trot(robot)
    rng = np.random.default_rng(0)
    for i in range(TICKS):
        moment = replace(
            state,
            stamp=0.141 + 0.0001 * i,
            p_WB=state.p_WB + rng.normal(scale=0.002, size=3),
            v_WB=state.v_WB + rng.normal(scale=0.02, size=3),
            joint_velocities=state.joint_velocities + rng.normal(scale=0.05, size=12),
        )
        yield moment, policy


def ticks(control, robot, others=None):
    """Computes all situations; returns time before the program, in it, after it, and in all, of each [s].

    ``others``: an array that is written to between the ticks.
    """
    program, after = Stopwatch(), Stopwatch()
    for name in ("solve", "solve_matrices"):
        if hasattr(control._method, name) and (name == "solve") == (control._tick is None):
            setattr(control._method, name, program.wrap(getattr(control._method, name)))
    if control._tick is not None:
        control._tick.finish = after.wrap(control._tick.finish)
    command, times = replace(WholeBodyCommand.empty(), foot_modes=np.array([0, 1, 1, 0])), []
    for state, policy in situations(robot):
        if others is not None:
            others += 1.0
        already = program.total, after.total
        start = time.thread_time()
        command = control.compute(state, policy, command)
        total = time.thread_time() - start
        inside, behind = program.total - already[0], after.total - already[1]
        times.append((total - inside - behind, inside, behind, total))
    assert command.fallbacks == 0
    return np.array(times)


@pytest.mark.parametrize("variant", VARIANTS)
def test_tick(benchmark, variant):
    benchmark.group = f"{TICKS} ticks of whole-body control"
    robot = load_robot("anymal_c")
    config = WbcConfig(**VARIANTS[variant])
    ticks(TaskSpaceInverseDynamics(robot, config), robot)
    rounds = []
    benchmark.pedantic(lambda: rounds.append(ticks(TaskSpaceInverseDynamics(robot, config), robot)), rounds=3)
    times = np.concatenate(rounds)
    assert len(times) == len(rounds) * TICKS and (times[:, 3] > 0.0).all()
    cold = np.median(ticks(TaskSpaceInverseDynamics(robot, config), robot, np.zeros(4_000_000))[:, 3])
    _rows.append((variant, *np.median(times, axis=0), np.percentile(times[:, 3], 95), cold))


@pytest.mark.parametrize("dynamics", [RobotDynamics, PlantDynamics])
def test_kinematics(benchmark, dynamics):
    """Compiled terms against a MultibodyPlant through pydrake."""
    benchmark.group = "mass matrix, bias, feet"
    robot = load_robot("anymal_c")
    state, _ = mid_trot(robot)
    terms = dynamics(robot)
    expected = PlantDynamics(robot).evaluate(state)
    np.testing.assert_allclose(benchmark(terms.evaluate, state).bias, expected.bias, atol=1e-6)
