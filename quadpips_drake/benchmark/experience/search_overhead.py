"""What experience and labels take of the foothold search's time: the same searches with and without them, in turn."""

import gc
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from quadpips_drake.benchmark.experience.course import OfflineCourse, label_image
from quadpips_drake.diagrams.planning_module import PlanningConfig, first_library
from quadpips_drake.files import write_json
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.planning.experience.edge_experience import EdgeExperience
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.learning import in_scope, leg_bits
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.swing_plan import ExperienceLibrary

STORE = "overhead.json"
ROUNDS = 5
RECORDS = 5000
WITHOUT = "without"
_PAIRS = ((Leg.LF, Leg.RH), (Leg.RF, Leg.LH))


def measure_overhead(robot_name: str, terrain_name: str, seeds: list[int], planning: PlanningConfig, folder: Path) -> dict:
    """Measures the first search on the terrain of each seed, each way ROUNDS times in turn, the fastest of which counts.

    Returns: by the name of the way a dict with "ms" and "expansions", one of each for each seed; also in STORE.
    """
    robot, found = load_robot(robot_name), defaultdict(lambda: {"ms": [], "expansions": []})
    for seed in seeds:
        course = OfflineCourse(robot, load_terrain(terrain_name, seed=seed))
        for name, (ms, expansions) in _searches(course, planning, seed).items():
            found[name]["ms"].append(round(ms, 3))
            found[name]["expansions"].append(expansions)
    write_json(folder / STORE, dict(found))
    return dict(found)


def overhead_rows(found: dict) -> list[tuple[str, ...]]:
    """For a table: times, and ratios to searches without, of a search and of one expansion."""
    base, rows = found[WITHOUT], []
    for name, values in found.items():
        ms, count = np.array(values["ms"]), np.array(values["expansions"])
        ratio = ms / np.array(base["ms"])
        each = ratio * np.array(base["expansions"]) / count
        numbers = (np.median(ms), ms.max(), np.median(count), np.median(ratio), np.median(each))
        rows.append((name, *(f"{number:.2f}" for number in numbers)))
    return rows


OVERHEAD_COLUMNS = ("searches", "median [ms]", "most [ms]", "expansions", "ratio", "ratio of an expansion")
"""Of ``overhead_rows``; all but the most are medians."""


def scattered_records(
    robot: RobotModel, terrain, config: ExperienceConfig, count: int, costs: float, seed: int = 0
) -> ExperienceLibrary:
    """A library of ``count`` transitions on the way from start to goal, drawn by ``seed``.

    Args:
        robot, terrain: whose steps, and where.
        config: with their scope.
        costs: largest mean cost of a record; they are drawn from 0 on.
    """
    rng, nominal = np.random.default_rng(seed), robot.soles_W(robot.nominal_footholds_B)
    nominal = nominal - [0.0, 0.0, nominal[:, 2].mean()]
    ends = np.array([terrain.start[:2], terrain.goal])
    before, after, legs = np.empty((count, 4, 3)), np.empty((count, 4, 3)), np.empty(count, np.uint8)
    for k in range(count):
        axes, pair = yaw_matrix(0.1 * rng.standard_normal()), _PAIRS[rng.integers(2)]
        base = np.append(ends[0] + rng.random() * (ends[1] - ends[0]) + rng.uniform(-0.1, 0.1, 2), 0.0)
        feet = base + (nominal + 0.04 * rng.standard_normal((4, 3)) * [1.0, 1.0, 0.3]) @ axes.T
        landed, swung = feet.copy(), [int(leg) for leg in pair]
        landed[swung] += (0.05 * rng.standard_normal((2, 3)) + [0.3, 0.0, 0.0]) @ axes.T
        before[k], after[k] = in_scope(config.scope, feet, landed)
        legs[k] = leg_bits(pair)
    phase, last = np.zeros(count, np.uint8), np.ones(count, np.int64)
    return ExperienceLibrary(
        config.scope, robot.name, trials=1, phase=phase, legs=legs, before=before, after=after,
        count=np.ones(count, np.int64), cost=costs * rng.random(count), status=np.zeros(count, np.uint8), last=last,
    )  # fmt: skip


def _searches(course: OfflineCourse, planning: PlanningConfig, seed: int) -> dict[str, tuple[float, int]]:
    """CPU time of the fastest round [ms] and expansions of each way."""
    state, goal, robot = course.start_state(), np.asarray(course.terrain.goal), course.robot
    regions = course.regions_around(state)
    path = search_torso_path(state.p_WB, state.rpy_WB[2], regions, goal, robot, planning.torso, request_id=1)
    labels = label_image(course, state, None)
    off, penalty = (replace(planning.footholds, steppability=word) for word in ("off", "penalty"))
    ways = {WITHOUT: (off, None), "0 records": (off, first_library(robot, planning))}
    for scope in ("site", "general"):
        settings = replace(planning.experience, scope=scope)
        for kind, costs in (("that cost nothing", 0.0), ("of any cost", settings.failure_cost)):
            library = scattered_records(robot, course.terrain, settings, RECORDS, costs, seed)
            ways[f"{RECORDS} records, {scope}, {kind}"] = (off, library)
    ways["labels"] = (penalty, None)
    times, expansions = defaultdict(list), {}
    gc.collect()
    gc.freeze()
    for _ in range(ROUNDS):
        for name, (config, library) in ways.items():
            began = time.thread_time()
            known = None if library is None else EdgeExperience.of(library, planning.experience)
            plan = search_footholds(state, path.regions, path, robot, config, labels=labels, experience=known)
            times[name].append(1e3 * (time.thread_time() - began))
            expansions[name] = plan.expansions
    return {name: (min(some), expansions[name]) for name, some in times.items()}
