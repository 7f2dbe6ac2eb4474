"""Probe of the searches without a simulation: from the start plan after plan to the goal, over exact regions.

    python -m tests.planning.probe --robot anymal_c beam:0.25 trench:0.4 flat:180 [--set footholds.max_swing=0.5] [--camera]
    python -m tests.planning.probe --robot go2 --camera go2_ramped_stones:0 sparse_stones:3       any of the library, by seed
    python -m tests.planning.probe flat:0 stepping:0.1 --overhead

Each plan starts where the last one ended, with its feet exactly there. ``--camera`` shows the planners only what a front
camera and its memory would know; else everything within 1.9 m. One line a world: plans, failures, expansions, times. With
``footholds.steppability=penalty`` the footholds' labels are those in an image of the front camera. ``--overhead``: each
foothold search is made with labels excluded and with the penalty, in turn; the second line says what that takes.
"""

import argparse
import time
from collections import defaultdict
from dataclasses import dataclass, field, replace

import numpy as np

from quadpips_drake.diagrams.planning_module import PlanningConfig
from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig, centers_of, regions_from_terrain
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.torso.subgoals import Exploration
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot, robot_defaults_layer
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.values.regions import RegionSet
from tests.planning import worlds
from tests.planning.label_images import by_front_camera
from tests.planning.probe_worlds import WORLDS

TRACE = False


class Eyes:
    """Which regions a robot knows: those around it, or those that its front camera has seen and its memory keeps."""

    def __init__(self, terrain, robot, camera: bool, radius=1.9, half_extent=1.75, every_label=False):
        self._all = regions_from_terrain(terrain, robot.foot_radius, OracleRegionConfig(), every_label)
        self._centers = centers_of(self._all)[:, :2]
        self._camera, self._radius, self._half_extent = camera, radius, half_extent
        self._ahead = float(robot.camera().X_BC[0, 3])
        self._nearest = 0.35  # both cameras look over the ground before them
        self._size = 1.0 if robot.nominal_base_height > 0.45 else 0.6
        self._known = np.zeros(len(self._all), bool)
        self._started = False

    def look(self, x, y, yaw) -> RegionSet:
        offset = self._centers - [x, y]
        if not self._camera:
            return self._as_set(np.hypot(*offset.T) <= self._radius)
        c, s = np.cos(yaw), np.sin(yaw)
        local = offset @ np.array([[c, -s], [s, c]])
        if not self._started:
            self._started, size = True, self._size
            self._known |= (local[:, 0] > -0.8 * size) & (local[:, 0] < 1.2 * size) & (abs(local[:, 1]) < 0.5 * size)
        view = local - [self._ahead, 0.0]
        distance, bearing = np.hypot(*view.T), np.arctan2(view[:, 1], view[:, 0])
        self._known |= (abs(bearing) < 0.70) & (distance > self._nearest) & (distance < 1.75)
        self._known &= np.abs(offset - self._ahead * np.array([c, s])).max(axis=1) < self._half_extent * self._size
        return self._as_set(self._known)

    def _as_set(self, mask) -> RegionSet:
        return RegionSet(0.0, tuple(self._all[k] for k in np.flatnonzero(mask)))


@dataclass
class Report:
    """What came of one world."""

    reached: bool = False
    plans: int = 0
    failures: list = field(default_factory=list)
    expansions: list = field(default_factory=list)
    swings: int = 0
    torso_ms: list = field(default_factory=list)
    foothold_ms: list = field(default_factory=list)
    where: tuple = (0.0, 0.0)
    distance: float = 0.0
    widths: list = field(default_factory=list)

    def line(self, name: str) -> str:
        torso, feet = (np.percentile(t, 95) if t else 0.0 for t in (self.torso_ms, self.foothold_ms))
        width = f"{min(self.widths):.2f}/{np.median(self.widths):.2f}" if self.widths else "-"
        text = (
            f"{name:22s} {'REACHED' if self.reached else 'lost   '} plans {self.plans:2d} failed {len(self.failures)} "
            f"swings {self.swings:3d} expansions {sum(self.expansions):5d} width {width} "
            f"torso {torso:5.1f} ms footholds {feet:5.1f} ms"
        )
        if not self.reached:
            text += f" at {self.where[0]:.2f},{self.where[1]:.2f}, {self.distance:.2f} m off: {self.failures[-1:]}"
            print("\n".join(f"    {reason}" for reason in dict.fromkeys(self.failures)))
        return text


def planning_config(robot: str, **changes) -> PlanningConfig:
    """The robot's defaults with ``section.key`` replaced."""
    config = PlanningConfig()
    layer = robot_defaults_layer(robot).data.get("planning", {})
    sections = {name: dict(values) for name, values in layer.items()}
    for key, value in changes.items():
        section, name = key.split(".")
        sections.setdefault(section, {})[name] = value
    return replace(config, **{name: replace(getattr(config, name), **values) for name, values in sections.items()})


def widths_of(plan) -> list[float]:
    """Widths of all stances but the first, fore and hind [m]."""
    result = []
    for stance in plan.stances[1:]:
        yaw = stance.rpy_WB[2]
        side = (stance.footholds[:, :2] @ [-np.sin(yaw), np.cos(yaw)])[[0, 2, 1, 3]]
        result += [float(side[0] - side[2]), float(side[1] - side[3])]
    return result


def walk(terrain, robot, config: PlanningConfig, *, camera=False, max_plans=40, observe=None) -> Report:
    """Plans to the goal, or to the end of the monitor's patience.

    ``observe(state, path, labels)`` is called before each foothold search.
    """
    every_label = config.footholds.every_label
    eyes, report = Eyes(terrain, robot, camera, every_label=every_label), Report()
    x, y, yaw = terrain.start
    state, goal = worlds.standing_state(robot, x, y, yaw), np.array(terrain.goal, float)
    failed, level, exploration, path = 0, 0, Exploration(), None
    while report.plans < max_plans and failed < config.monitor.max_failed_plans:
        report.where = tuple(state.p_WB[:2])
        report.distance = float(np.hypot(*(state.p_WB[:2] - goal)))
        if report.distance < config.monitor.goal_tolerance:
            report.reached = True
            break
        report.plans += 1
        regions = eyes.look(*state.p_WB[:2], float(state.rpy_WB[2]))
        failed_path = path.poses if failed else None
        exploration = exploration.standing_at((*state.p_WB[:2], float(state.rpy_WB[2])), goal, failed_path)
        t0 = time.thread_time()
        path = search_torso_path(
            state.p_WB, state.rpy_WB[2], regions, goal, robot, config.torso,
            request_id=report.plans, level=level, exploration=exploration, every_label=every_label,
        )  # fmt: skip
        report.torso_ms.append(1e3 * (time.thread_time() - t0))
        exploration = exploration.after(path)
        labels = by_front_camera(terrain, robot, state) if config.footholds.steppability == "penalty" else None
        if observe is not None and path.success:
            observe(state, path, labels)
        t1 = time.thread_time()
        plan = search_footholds(state, path.regions, path, robot, config.footholds, labels=labels)
        report.foothold_ms.append(1e3 * (time.thread_time() - t1))
        report.expansions.append(plan.expansions)
        if TRACE:
            x, y, yaw = *state.p_WB[:2], state.rpy_WB[2]
            end = path.poses[-1, [0, 1, 3]].round(2) if path.success else path.reason
            print(f"  {x:.2f} {y:.2f} {yaw:.2f} -> {end} swings {len(plan.swing_legs)} of {plan.expansions}")
        if not plan.success:
            report.failures.append(plan.reason)
            failed, level = failed + 1, max(level + 1, failed + 1)
            continue
        failed, level = 0, max(level - 1, 0)
        report.swings += len(plan.swing_legs)
        report.widths += widths_of(plan)
        state = worlds.state_at(robot, plan.stances[-1])
    return report


def _world(kind: str, numbers: list[str]):
    """A small world with its number, or a terrain of the library with its seed."""
    if kind in WORLDS:
        return WORLDS[kind](*map(float, numbers))
    return load_terrain(kind, seed=int(numbers[0]) if numbers else 0)


class Overhead:
    """What the penalty of labels takes: each search several times with and without it, in turn."""

    ROUNDS = 5

    def __init__(self, terrain, robot, config):
        self._terrain, self._robot = terrain, robot
        self._ways = {word: replace(config.footholds, steppability=word) for word in ("exclude", "penalty")}
        self.ms, self.expansions = defaultdict(list), defaultdict(list)

    def __call__(self, state, path, labels):
        labels = labels or by_front_camera(self._terrain, self._robot, state)
        times = defaultdict(list)
        for _ in range(self.ROUNDS):
            for word, config in self._ways.items():
                start = time.thread_time()
                plan = search_footholds(state, path.regions, path, self._robot, config, labels=labels)
                times[word].append(1e3 * (time.thread_time() - start))
                self.expansions[word].append(plan.expansions)
        for word, some in times.items():
            self.ms[word].append(min(some))

    def line(self) -> str:
        exclude, penalty = (np.array(self.ms[word]) for word in self._ways)
        each = [np.sum(self.ms[word]) * self.ROUNDS / np.sum(self.expansions[word]) for word in self._ways]
        return (
            f"    {len(exclude)} searches: exclude {np.median(exclude):.2f} ms, penalty {np.median(penalty):.2f} ms, ratio "
            f"{np.median(penalty / exclude):.2f} (medians); an expansion {each[0]:.3f} and {each[1]:.3f} ms"
        )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("worlds", nargs="+")
    parser.add_argument("--robot", default="anymal_c")
    parser.add_argument("--camera", action="store_true")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--trace", action="store_true", help="show each plan")
    parser.add_argument("--overhead", action="store_true", help="compare the times of searches with and without labels")
    args = parser.parse_args()
    global TRACE
    TRACE = args.trace
    changes = {}
    for item in args.set:
        key, value = item.split("=")
        changes[key] = float(value) if value.replace(".", "").isdigit() and "." in value else value
        if value.isdigit():
            changes[key] = int(value)
    robot, config = load_robot(args.robot), planning_config(args.robot, **changes)
    for name in args.worlds:
        kind, *numbers = name.split(":")
        terrain = _world(kind, numbers)
        overhead = Overhead(terrain, robot, config) if args.overhead else None
        report = walk(terrain, robot, config, camera=args.camera, observe=overhead)
        print(report.line(name), flush=True)
        if overhead is not None:
            print(overhead.line(), flush=True)


if __name__ == "__main__":
    main()
