"""Asks our foothold search, offline: walks over terrains whose regions are known exactly, stance by stance.

Walk number i depends on the seed and on i alone. Terrains of trials (seeds 0 to 9 for developing, 100 to 109 for benchmarks)
are none of them: seeds begin at 1000. A beam, in whatever shape, is not among the terrains at all.
"""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.learned_footholds.swing_data import MANIFEST, Swings, read_rows, write_rows
from quadpips_drake.baselines.learned_footholds.swing_view import patch_cell, swing_view
from quadpips_drake.baselines.region_projection import best_foothold, leg_penalty
from quadpips_drake.diagrams.planning_module import PlanningConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json, write_json
from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.perception.regions.oracle_regions import (
    OracleRegionConfig,
    centers_of,
    nearby_regions,
    regions_from_terrain,
)
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.footholds.stance_transitions import pose_of_stance_legs
from quadpips_drake.planning.nominal_pose import base_pose_above
from quadpips_drake.planning.region_table import in_convex_polygon, make_region_table, outline_table
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.standing_pose import standing_pose
from quadpips_drake.terrain.terrain import GOAL_TOLERANCE, Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.loading import load_config
from quadpips_drake.values.plans import FootholdPlan, Stance
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.worker_pool import results_of

FIRST_SEED = 1000
"""Smaller ones are left to trials."""
UNFINISHED = "unfinished"
"""Folder beside the data, for the walks of a collection that has not come to its end."""
TERRAINS = {
    "flat": None,
    "bumps": (0.01, 0.06),
    "gap": (0.1, 0.4),
    "pegboard": (0.02, 0.08),
    "rubble": (0.05, 0.25),
    "sparse_stones": (0.35, 0.7),
    "stairs_10": (0.04, 0.15),
    "stepping_stones": (0.0, 0.25),
}
"""Name -> range of the difficulty, which is drawn."""
SPLIT_OF_ROUND = ("train", "train", "val", "train", "test")
"""Which rounds are learned from, in turn."""
GAIT = "standing_trot"
"""In which diagonal pairs swing, as in the walk that the network is for."""
_SWING = (0.10, 0.35)
"""Range of the preferred swing, which is drawn for each plan [m]: from half to twice that of a trot at 0.25 m/s."""
_MOST_PLANS = 40
_KEPT_SWINGS = 3
"""Swings of a plan that are done before the next one is asked for [1]."""
_STRAY = 0.02
"""Standard deviation of the feet about the plan's footholds, then [m]: a walk does not meet them either."""


@dataclass(frozen=True)
class PlannedCourse:
    """One walk to be."""

    number: int
    terrain: str
    seed: int
    split: str


def plan_courses(rounds: int, seed: int) -> list[PlannedCourse]:
    """All walks of so many ``rounds`` over TERRAINS.

    Raises:
        UserInputError: the seed is one of a trial's, or there are too few rounds for all splits.
    """
    if seed < FIRST_SEED:
        raise UserInputError(f"--seed {seed}: seeds below {FIRST_SEED} are those of trials; give a larger one")
    if rounds < len(SPLIT_OF_ROUND):
        raise UserInputError(f"--rounds {rounds}: give at least {len(SPLIT_OF_ROUND)}, for training, validation and test")
    return [
        PlannedCourse(number, name, seed + number, SPLIT_OF_ROUND[number // len(TERRAINS) % len(SPLIT_OF_ROUND)])
        for number, name in enumerate(list(TERRAINS) * rounds)
    ]


def manifest_of(robot: RobotModel, courses: list[PlannedCourse], seed: int) -> dict:
    """What there is to tell about the data of these courses."""
    walks = [{"terrain": course.terrain, "seed": course.seed, "split": course.split} for course in courses]
    return {"robot": robot.name, "cell": patch_cell(robot), "gait": GAIT, "seed": seed, "walks": walks}


def collect(
    robot: RobotModel, courses: list[PlannedCourse], seed: int, folder: Path, *, workers: int = 1, resume: bool = False
) -> Iterator[tuple[int, int]]:
    """Walks the ``courses``, each into a file of its own in ``folder``; yields (walks done, in all) at first and after each.

    With ``resume`` those are kept that an interrupted call with the same arguments has left there. More than one of
    ``workers`` are processes; the rows are the same for any number of them.

    Raises:
        UserInputError: the folder holds other walks, or some and ``resume`` is not set.
        JobFailed: at the end, when walks are missing.
    """
    _claim(folder, manifest_of(robot, courses, seed), resume)
    missing = [course for course in courses if not (folder / _name(course)).is_file()]
    done = len(courses) - len(missing)
    yield done, len(courses)
    jobs = {f"walk {course.number}": partial(_walk_into, folder, robot.name, course) for course in missing}
    with closing(results_of(jobs, workers=workers if workers > 1 else 0, what="walks")) as walks:
        for _ in walks:
            done += 1
            yield done, len(courses)


def collected(courses: list[PlannedCourse], folder: Path) -> Swings:
    """The rows that ``collect`` has left in ``folder``, walk by walk."""
    return Swings.joined([read_rows(folder / _name(course)) for course in courses])


def _claim(folder: Path, manifest: dict, resume: bool) -> None:
    """Makes the folder one of this collection."""
    path = folder / MANIFEST
    if path.exists():
        if not resume:
            raise UserInputError(
                f"--out {folder.parent}: holds a collection that was interrupted; add --resume to go on with it, or give "
                "another directory"
            )
        if read_json(path) != manifest:
            raise UserInputError(f"--resume: the walks in {folder} were made with other options")
    folder.mkdir(exist_ok=True)
    write_json(path, manifest)


def _name(course: PlannedCourse) -> str:
    return f"walk_{course.number:04d}.npz"


def _walk_into(folder: Path, robot_name: str, course: PlannedCourse) -> None:
    """Walks one course and writes its rows."""
    robot, rng, bounds = load_robot(robot_name), np.random.default_rng([course.seed, 37]), TERRAINS[course.terrain]
    difficulty = None if bounds is None else float(rng.uniform(*bounds))
    terrain = load_terrain(course.terrain, seed=course.seed, difficulty=difficulty)
    rows = course_rows(robot, load_config(robot_name).stages.planning, terrain, rng, course.number)
    write_rows(folder / _name(course), Swings.of(rows))


def course_rows(robot: RobotModel, planning: PlanningConfig, terrain: Terrain, rng, number: int = 0) -> list[tuple]:
    """Walks from plan to plan as far as they lead; returns (inputs, offset, nearest, ``number``) of each leg's swings."""
    config = OracleRegionConfig()
    regions, goal = regions_from_terrain(terrain, robot.foot_radius, config), np.asarray(terrain.goal, dtype=float)
    centers, state, rows = centers_of(regions), _start(robot, terrain, rng), []
    for request in range(1, _MOST_PLANS + 1):
        if np.hypot(*(state.p_WB[:2] - goal)) < GOAL_TOLERANCE:
            break
        near = RegionSet(0.0, nearby_regions(regions, state.p_WB, config.radius, centers))
        path = search_torso_path(state.p_WB, state.rpy_WB[2], near, goal, robot, planning.torso, request_id=request)
        swing = float(rng.uniform(*_SWING))
        asked = replace(planning.footholds, gait=GAIT, careful_gait=GAIT, preferred_swing=swing)
        plan = search_footholds(state, near, path, robot, asked)
        if not plan.success:
            break
        rows += plan_rows(plan, near, robot, number)
        stance = plan.stances[min(_KEPT_SWINGS, len(plan.stances) - 1)]
        state = _standing_on(robot, _strayed(stance, rng), stance.normals, planning.footholds.max_tilt)
    return rows


def plan_rows(plan: FootholdPlan, regions: RegionSet, robot: RobotModel, number: int = 0) -> list[tuple]:
    """(inputs, offset, nearest, ``number``) of each leg's swings of a plan.

    The wish is what a walk of the plan's mean speed would wish for: the foot's nominal place under the base that belongs to
    the feet on the ground, carried on by the way that the base makes within a swing on average.
    """
    nominal, cell = np.array(robot.nominal_footholds_B[:, :2]), patch_cell(robot)
    table, outlines = make_region_table(regions.regions), outline_table(regions.regions)
    legs, unlimited = leg_penalty(robot, 1.0, 0.0), (np.empty((0, 3)), np.empty((0, 3, 3)))
    first, last, swings = plan.stances[0], plan.stances[-1], len(plan.swing_legs)
    step = (last.p_WB[:2] - first.p_WB[:2]) / swings
    turn = float(wrap_angle(last.rpy_WB[2] - first.rpy_WB[2])) / swings
    rows = []
    for before, after, swinging in zip(plan.stances[:-1], plan.stances[1:], plan.swing_legs, strict=True):
        feet, away = np.array(before.footholds), np.zeros(4, dtype=bool)
        away[list(swinging)] = True
        x, y, yaw = pose_of_stance_legs(feet, away, 0.0, nominal)
        c, s = np.cos(yaw + turn), np.sin(yaw + turn)
        for leg in swinging:
            wish = np.array([x, y]) + step + np.array([[c, -s], [s, c]]) @ nominal[leg]
            view = swing_view(feet, swinging, leg, wish, nominal, cell, outlines)
            point = np.append(wish, feet[~away, 2].mean())
            k, *nearest = best_foothold(table, int(leg), point, *unlimited, legs, np.inf)
            if view is not None and k >= 0:
                chosen = view.offset(after.footholds[leg][:2]), view.offset(np.array(nearest[:2]))
                rows.append((view.inputs, *chosen, number))
    return rows


def _start(robot: RobotModel, terrain: Terrain, rng) -> RobotState:
    """At the start, turned a little."""
    x, y, yaw = terrain.start
    yaw += float(rng.uniform(-0.25, 0.25))
    p_WB, joints = standing_pose(robot, GroundTruth(terrain), x, y, yaw)
    rpy = np.array([0.0, 0.0, yaw])
    return replace(standing_state(robot), p_WB=p_WB, rpy_WB=rpy, R_WB=rotation_from_rpy(rpy), joint_positions=joints)


def _strayed(stance: Stance, rng) -> np.ndarray:
    """Ground points (4, 3) near those of ``stance``, where their regions have room."""
    feet = np.array(stance.footholds)
    for leg, region in enumerate(stance.regions):
        aside = rng.normal(0.0, _STRAY, 2)
        place = (feet[leg] - region.center) @ region.X_WR[:3, :2] + aside
        if in_convex_polygon(place, region.inset):
            feet[leg] = region.center + region.X_WR[:3, :2] @ place
    return feet


def _standing_on(robot: RobotModel, feet: np.ndarray, normals: np.ndarray, max_tilt: float) -> RobotState:
    """The robot at rest with its soles at ``feet`` (4, 3)."""
    p_WB, rpy = base_pose_above(feet, robot.nominal_base_height, max_tilt)
    centers = feet + robot.foot_radius * normals
    joints, _ = robot.joints_following(p_WB[None], rpy[None], centers[None], robot.nominal_joints)
    return replace(standing_state(robot), p_WB=p_WB, rpy_WB=rpy, R_WB=rotation_from_rpy(rpy), joint_positions=joints[0])
