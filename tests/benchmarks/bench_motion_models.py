"""How long a plan over velocity commands takes, and a foot costmap.

Not part of the tests; run on a calm machine with

    OPENBLAS_NUM_THREADS=1 taskset -c 0 pytest -s tests/benchmarks/bench_motion_models.py

ANYmal C stands at many places of the courses and plans with horizons 3, 5 and 7, over the exact map and the learned models
(where the package has none yet, over those of a white box). The printed table is Markdown, in ms of wall-clock time; the
paper's are means of its Table II, on the computer of the robot or beside it (not told).
"""

import time

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.line_holding import Line
from quadpips_drake.baselines.motion_models.planner.command_search import CommandSearch, CommandSearchConfig
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmapConfig, exact_costmap, foot_costmap
from quadpips_drake.baselines.motion_models.planner.variants import belief_of
from quadpips_drake.baselines.motion_models.state import StepState
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.egocan.ground_memory import GroundMemoryConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.regions import GroundHeights

TERRAINS = ("gaps_symmetric", "gaps_staggered", "gaps_and_steps")
PAPER = {
    ("gaps_symmetric", 3): 0.239, ("gaps_symmetric", 5): 0.924, ("gaps_symmetric", 7): 1.75,
    ("gaps_staggered", 3): 0.475, ("gaps_staggered", 5): 0.765, ("gaps_staggered", 7): 0.975,
    ("gaps_and_steps", 3): 0.234, ("gaps_and_steps", 5): 0.825, ("gaps_and_steps", 7): 1.20,
}  # fmt: skip
PLACES = 300
SEARCHES, COSTMAPS = [], []


@pytest.fixture(scope="module", autouse=True)
def table():
    yield
    print("\n\n| terrain | N | mean | p50 | p95 | max | expansions | plans found | the paper's mean |\n|---|" + 8 * "---|")
    for row in SEARCHES:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print("\n| costmap | cells | p50 | p95 |\n|---|---|---|---|")
    for row in COSTMAPS:
        print("| " + " | ".join(str(cell) for cell in row) + " |")


def belief():
    robot, walk = load_robot("anymal_c"), VelocityReferenceConfig()
    try:
        return belief_of("learned", robot, "trot", None, walk, None)
    except UserInputError:
        return belief_of("kinematic", robot, "trot", None, walk, None)


def starts(goal_x: float) -> list[StepState]:
    """Robots on their way, with feet near their places and commands of before."""
    rng, nominal = np.random.default_rng(0), load_robot("anymal_c").nominal_footholds_B[:, :2]
    found = []
    for k in range(PLACES):
        speed = rng.uniform(0.0, 0.6, 3)
        place = np.array([rng.uniform(-1.0, goal_x - 0.5), rng.uniform(-0.05, 0.05)])
        feet = nominal + np.column_stack((rng.uniform(-0.08, 0.08, 4), rng.uniform(-0.02, 0.02, 4)))
        before, command = np.array([speed[1], 0.0]), np.array([speed[2], 0.0, 0.0])
        found.append(StepState(place, 0.0, np.array([speed[0], 0.0]), before, command, feet, k % 2))
    return found


@pytest.mark.parametrize("horizon", [3, 5, 7])
@pytest.mark.parametrize("terrain", TERRAINS)
def test_a_plan(benchmark, terrain, horizon):
    benchmark.group = "a plan"
    world, known = load_terrain(terrain), belief()
    truth, config = GroundTruth(world), FootCostmapConfig(exact_reach=6.0)
    costmap = exact_costmap(truth, 0.0, np.array([2.0, 0.0]), config)
    search = CommandSearch(known.models, CommandSearchConfig(horizon=horizon), acceleration=known.acceleration)
    line, times, plans, places = Line(world.goal, 0.0), [], [], iter(starts(float(world.goal[0])) * 50)

    def plan():
        start = next(places)
        heights = truth.height(*start.feet_W.T)
        began = time.perf_counter()
        found = search.plan(start, heights, 0.0, costmap, world.goal, line, stamp=0.0, id=1)
        times.append(1e3 * (time.perf_counter() - began))
        plans.append(found)

    plan()
    times.clear(), plans.clear()
    benchmark.pedantic(plan, rounds=PLACES)
    p50, p95 = np.percentile(times, [50, 95])
    expansions, found = np.mean([p.expansions for p in plans]), np.mean([p.found for p in plans])
    assert plans and all(p.expansions > 0 for p in plans), "nothing was searched"
    row = [terrain, horizon, *(f"{value:.3f}" for value in (np.mean(times), p50, p95, max(times)))]
    SEARCHES.append([*row, f"{expansions:.0f}", f"{found:.0%}", PAPER[terrain, horizon]])


def test_a_costmap_of_remembered_ground(benchmark):
    benchmark.group = "a costmap"
    cells, rng = GroundMemoryConfig().cells, np.random.default_rng(0)
    height = rng.normal(0.0, 0.003, (cells, cells)).astype(np.float32)
    height[:, 100:110] = np.nan
    height[rng.random(height.shape) < 0.02] = np.nan
    ground, times = GroundHeights(0.0, np.zeros(2), 0.01, height), []
    safe = foot_costmap(ground, FootCostmapConfig()).safe
    assert safe.any() and not safe[np.isnan(height)].any()

    def make():
        began = time.perf_counter()
        foot_costmap(ground, FootCostmapConfig())
        times.append(1e3 * (time.perf_counter() - began))

    benchmark.pedantic(make, rounds=100, warmup_rounds=5)
    COSTMAPS.append(["remembered ground", cells**2, *(f"{value:.2f}" for value in np.percentile(times, [50, 95]))])
