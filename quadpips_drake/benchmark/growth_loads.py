"""What is measured by the study of growth, at one size each: computing time of the process and its memory.

Each function here is called in a process of its own. It returns seconds of CPU time by curve, medians of repetitions in
which everything was loaded and compiled before, and the memory that the size took.
"""

import gc
import math
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from quadpips_drake.benchmark.growth_worlds import field_of_boxes, paved_lane, square_of_stones
from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.control.mpc.real_time_iteration import MpcMemory, RealTimeIteration
from quadpips_drake.control.references.velocity_reference import VelocityWalk, WalkMemory
from quadpips_drake.diagrams.observed_station import ObservedStation
from quadpips_drake.diagrams.simulation_station import StationConfig
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import begin_memory, update_memory
from quadpips_drake.perception.normals.normal_estimator_system import make_affordance_image
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.sensing.depth_camera import DepthCameraConfig
from quadpips_drake.sensing.self_filter import blank_own_body
from quadpips_drake.terrain.files.terrain_file import write_terrain_file
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.ocp.ocp_config import OcpConfig
from quadpips_drake.trajectory.ocp.optimal_control_problem import OptimalControlProblem
from quadpips_drake.trajectory.ocp.tracking_task import TrackingTask
from quadpips_drake.trials.loading import load_config
from quadpips_drake.trials.trial import Trial
from quadpips_drake.values.regions import RegionSet

ROBOT = "anymal_c"
_SAMPLE_PERIOD = 0.01
"""Between two looks of the judge [s]."""


@dataclass
class Measurement:
    """Collects the CPU times of one point, and sees how much memory it takes."""

    quick: bool
    """Whether a few repetitions must do."""
    times: dict[str, list[float]] = field(default_factory=dict)
    """[s], by curve."""
    _before: float = 0.0

    def begin(self) -> None:
        """From here on memory counts: what is needed at any size has been loaded."""
        gc.collect()
        self._before = _status_mb("VmRSS")

    def repetitions(self, number: int) -> range:
        """Counts to ``number``, or only to 1."""
        return range(1 if self.quick else number)

    def time(self, curve: str, work: Callable):
        """Files the CPU time of one call of ``work`` under ``curve``; returns its result."""
        start = time.process_time()
        result = work()
        self.times.setdefault(curve, []).append(time.process_time() - start)
        return result

    def memory(self) -> dict[str, float]:
        """The most that was ever resident, and what has come in addition since ``begin`` [MB]."""
        peak = _status_mb("VmHWM")
        return {"peak": round(peak, 1), "added": round(max(peak - self._before, 0.0), 1)}

    def result(self, memory: dict[str, float]) -> dict:
        """What the study keeps of the point."""
        seconds = {curve: float(f"{np.median(times):.4g}") for curve, times in self.times.items()}
        return {"seconds": seconds, "memory_mb": memory}


def _status_mb(key: str) -> float:
    """A size from Linux's account of this process [MB]; NaN elsewhere."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return math.nan
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith(f"{key}:")), math.nan)


def elements(count: int, quick: bool) -> dict:
    """A robot that stands on ``count`` boxes: from the terrain file to simulated time, and the terrain's truth."""
    m = Measurement(quick)
    with tempfile.TemporaryDirectory() as folder:
        small, path = Path(folder) / "small.yaml", Path(folder) / "field.yaml"
        write_terrain_file(field_of_boxes(10), small)
        write_terrain_file(field_of_boxes(count), path)
        if not quick:
            _stand(Measurement(True), small, 0.05)
        m.begin()
        trial = _stand(m, path, 0.05 if quick else 1.0)
        memory = m.memory()
        image, context = trial.diagram.station.GetOutputPort("depth_image"), trial.context
        image_context = trial.diagram.station.GetMyContextFromRoot(context)
        for _ in m.repetitions(15):
            context.SetTime(context.get_time() + 1e-4)
            m.time("camera image", lambda: image.Eval(image_context))
        for _ in m.repetitions(3)[1:]:
            _build(m, path)
    _ask_truth(m, trial.terrain)
    return m.result(memory)


def _build(m: Measurement, path: Path) -> Trial:
    config = load_config(ROBOT, terrain=str(path))
    terrain = m.time("reading the file", lambda: load_terrain(str(path)))
    return m.time("building", lambda: Trial(config, terrain=terrain))


def _stand(m: Measurement, path: Path, duration: float) -> Trial:
    """Lets the robot stand on the terrain in ``path`` for ``duration`` [s], with all stages at work."""
    trial = _build(m, path)
    station, simulator = trial.diagram.station, trial.simulator

    def begin():
        simulator.Initialize()
        trial.sample()
        simulator.AdvanceTo(station.config.time_step)

    def go_on():
        for tick in range(1, round(duration / _SAMPLE_PERIOD) + 1):
            station.bring_ground_near(trial.context)
            simulator.AdvanceTo(tick * _SAMPLE_PERIOD)
            trial.sample()

    m.time("first step", begin)
    m.time("simulated second", go_on)
    m.times["simulated second"][-1] /= duration
    return trial


def _ask_truth(m: Measurement, terrain) -> None:
    """Heights on the ground and beside it, where the nearest ground counts."""
    low, high = (bound[:2] for bound in terrain.bounds())
    rng = np.random.default_rng(0)
    inside, beside = rng.uniform(low, high, (1000, 2)).T, rng.uniform(high + 0.1, high + 0.5, (10, 2)).T
    GroundTruth(terrain).height(*inside)
    for _ in m.repetitions(5):
        m.time("truth, 1000 points", lambda: GroundTruth(terrain).height(*inside))
    for _ in m.repetitions(3):
        fresh = GroundTruth(replace(terrain))  # of which nothing is known yet
        m.time("truth, first off the ground", lambda truth=fresh: truth.nearest_walkable_height(*beside))


def image(pixels: int, quick: bool) -> dict:
    """A depth image of ``pixels`` (4 : 3) in front of stepping stones, from rendering to the egocan."""
    m = Measurement(quick)
    width = round(math.sqrt(pixels * 4 / 3))
    _look(Measurement(True), DepthCameraConfig(width=80, height=60))
    m.begin()
    _look(m, DepthCameraConfig(width=width, height=round(width * 3 / 4)))
    return m.result(m.memory())


def _look(m: Measurement, camera: DepthCameraConfig) -> None:
    from quadpips_drake.perception.steppability.model import load_model

    terrain, config = load_terrain("stepping_stones"), PerceptionConfig()
    station = ObservedStation(load_robot(ROBOT), terrain, StationConfig(camera=camera))
    context = station.CreateDefaultContext()
    station.set_initial_state(context, *terrain.start)
    robot, intrinsics, X_BC = station.robot, station.camera_intrinsics, station.robot.camera("front").X_BC
    state, port = station.GetOutputPort("robot_state").Eval(context), station.GetOutputPort("depth_image")
    depth = np.array(port.Eval(context).data[:, :, 0])
    affordance = make_affordance_image(depth, state, X_BC, intrinsics, config.normals)
    X_WB = np.eye(4)
    X_WB[:3, :3], X_WB[:3, 3] = state.R_WB, state.p_WB
    feet = robot.soles_W(robot.foot_positions_W(state))
    memory = begin_memory([affordance], 0.0, X_WB, feet, config.egocan)
    newer = replace(affordance, stamp=affordance.stamp + 0.03)
    model, down_C = load_model(), -affordance.X_WC[2, :3]
    model.segment(depth, down_C, intrinsics)
    for repetition in m.repetitions(15):
        context.SetTime(1e-3 * (1 + repetition))
        m.time("rendering", lambda: port.Eval(context))
        m.time(
            "self-filter",
            lambda: blank_own_body(depth.copy(), intrinsics, X_BC, state.joint_positions, robot, config.self_filter),
        )
        m.time("normals", lambda: make_affordance_image(depth, state, X_BC, intrinsics, config.normals))
        m.time("egocan", lambda: update_memory(memory, [newer], 0.0, config.egocan))
    for _ in m.repetitions(7):
        m.time("network", lambda: model.segment(depth, down_C, intrinsics))


def knots(count: int, quick: bool) -> dict:
    """An optimal control problem of ``count`` intervals over 1 s: its parts while standing, and an update of the MPC."""
    m = Measurement(quick)
    robot = load_robot(ROBOT)
    _iterate(Measurement(True), robot, 10)
    m.begin()
    _iterate(m, robot, count)
    return m.result(m.memory())


def _iterate(m: Measurement, robot, count: int) -> None:
    model = CentroidalModel(robot)
    problem, task, x0 = OptimalControlProblem(model, OcpConfig(), count), _standing_task(model, count), model.nominal_state()
    mpc, state = RealTimeIteration(robot, MpcConfig(intervals=count)), standing_state(robot)
    reference = VelocityWalk(robot).update(WalkMemory.empty(), state, np.array([0.3, 0.0, 0.0]), load_gait("trot")).reference
    guess = problem.iterate(x0, task)
    memory = mpc.compute(state, reference, MpcMemory.empty())
    for _ in m.repetitions(25):
        with patch("time.perf_counter", time.process_time):  # what the problem takes the times of its parts with
            solution = problem.iterate(x0, task, guess)
        for curve, seconds in (("linearisation", solution.linearisation_time), ("quadratic program", solution.qp_time)):
            m.times.setdefault(curve, []).append(seconds)
        m.time("MPC update", lambda: mpc.compute(state, reference, memory))


def _standing_task(model: CentroidalModel, count: int) -> TrackingTask:
    """Standing in the nominal stance for 1 s."""
    x, u = model.nominal_state(), model.gravity_compensation(np.ones(4))
    return TrackingTask(
        times=np.linspace(0.0, 1.0, count + 1),
        x_ref=np.tile(x, (count + 1, 1)),
        u_ref=np.tile(u, (count, 1)),
        stance=np.ones((count, 4), dtype=bool),
        foot_ref_p=np.tile(model.foot_positions(x), (count + 1, 1, 1)),
        foot_ref_v=np.zeros((count + 1, 4, 3)),
        surface_normal=np.tile([0.0, 0.0, 1.0], (count, 4, 1)),
    )


def regions(count: int, quick: bool) -> dict:
    """Both searches over ``count`` regions: more ground in stones of one size, and the same ground in finer pieces."""
    m = Measurement(quick)
    robot = load_robot(ROBOT)
    _plan(Measurement(True), robot, "", paved_lane(10))
    m.begin()
    _plan(m, robot, "more ground", square_of_stones(count))
    _plan(m, robot, "finer pieces", paved_lane(count))
    return m.result(m.memory())


def _plan(m: Measurement, robot, what: str, ground: tuple[RegionSet, np.ndarray]) -> None:
    known, goal = ground
    state, torso, footholds = standing_state(robot), TorsoConfig(), FootholdConfig()
    for _ in m.repetitions(7):
        path = m.time(
            f"torso search, {what}", lambda: search_torso_path(state.p_WB, 0.0, known, goal, robot, torso, request_id=1)
        )
        m.time(f"foothold search, {what}", lambda path=path: search_footholds(state, known, path, robot, footholds))
