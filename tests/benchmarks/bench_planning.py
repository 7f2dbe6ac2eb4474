"""How long one plan takes, from regions to a whole-body reference: torso search, foothold search, swings.

Not part of the tests; run with

    OPENBLAS_NUM_THREADS=1 taskset -c 0 pytest -s tests/benchmarks/bench_planning.py

A robot that stands in front of stepping stones or stairs, or on flat ground, plans towards a goal beyond them, again and
again; the first time, in which the problems are set up, is a row of its own. The printed table is Markdown, medians in ms of
the processor time of the one thread, so that other work on the machine hardly counts.
"""

import time

import numpy as np
import pytest

from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trajectory.swing import swing_optimizer
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer
from tests.planning.worlds import flat_ground, stairs, standing_state, stepping_stones

WORLDS = {"flat": flat_ground, "stepping_stones": stepping_stones, "stairs": stairs}
ROUNDS = 15
_rows = {}


@pytest.fixture(scope="module", autouse=True)
def table():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(swing_optimizer, "work_clock", time.thread_time)
        yield
    columns = (
        "torso",
        "footholds",
        "swings",
        "of which refinement",
        "all",
        "all, 95 %",
        "a swing",
        "a swing, 95 %",
        "length [s]",
    )
    print("\n\n| world | " + " | ".join(columns) + " |\n|---|" + "---|" * len(columns))
    for world, row in _rows.items():
        print(f"| {world} | " + " | ".join(f"{value:.1f}" for value in row) + " |")


@pytest.mark.parametrize("world", WORLDS)
def test_a_plan(benchmark, world):
    benchmark.group = "one plan"
    robot, regions = load_robot("anymal_c"), WORLDS[world]()
    optimizer, torso, footing = SwingOptimizer(robot), TorsoConfig(), FootholdConfig()
    state, goal, rounds, swings = standing_state(robot), np.array([3.5, 0.0]), [], []
    x0 = optimizer.model.state_from_robot_state(state)

    def plan():
        ticks = [time.thread_time()]
        path = search_torso_path(state.p_WB, 0.0, regions, goal, robot, torso, request_id=1)
        ticks.append(time.thread_time())
        footholds = search_footholds(state, regions, path, robot, footing)
        ticks.append(time.thread_time())
        result = optimizer.optimize(x0, footholds)
        ticks.append(time.thread_time())
        assert result.success and not result.fallbacks
        length = result.reference.end_time
        rounds.append((*np.diff(ticks), result.refinement_time, ticks[-1] - ticks[0], length))
        swings.extend(report.elapsed for report in result.reports)

    plan()
    _note(f"{world}, the first time", rounds, swings)
    rounds.clear(), swings.clear()
    benchmark.pedantic(plan, rounds=ROUNDS)
    _note(world, rounds, swings)


def _note(name, rounds, swings):
    torso, footholds, all_swings, refinement, total, length = 1e3 * np.median(rounds, axis=0)
    late, swing = 1e3 * np.percentile(np.array(rounds)[:, 4], 95), 1e3 * np.percentile(swings, [50, 95])
    _rows[name] = torso, footholds, all_swings, refinement, total, late, *swing, 1e-3 * length
