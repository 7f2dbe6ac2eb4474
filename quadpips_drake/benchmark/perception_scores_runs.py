"""Where the samples for the scores of perception come from: the whole system walking, or a camera led along a path."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import System
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.benchmark.perception_scores import FLOOR_RADIUS, Floor, PerceptionSample, PerceptionScorer
from quadpips_drake.diagrams.quadpips import QuadpipsConfig
from quadpips_drake.diagrams.region_sources import RegionSourceSetup, region_sources
from quadpips_drake.diagrams.simulation_station import SimulationStation
from quadpips_drake.errors import UserInputError
from quadpips_drake.estimation.pose_drift import drift_state, drifted_world
from quadpips_drake.framework.ports import input_names
from quadpips_drake.perception.elevation.elevation_config import with_preset
from quadpips_drake.perception.elevation.plane_decomposition import filter_map, find_planes
from quadpips_drake.perception.superpixels.superpixels import segment_superpixels
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.standing_pose import standing_pose
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.timing import StageTimings
from quadpips_drake.trials.trial import Trial, TrialConfig
from quadpips_drake.values.robot_state import RobotState

SAMPLE_PERIOD = 0.2
"""Between two scored moments [s]."""
_FRAMES_PER_SAMPLE = 6
"""Images of the led camera between two scored moments."""
FRAME_PERIOD = SAMPLE_PERIOD / _FRAMES_PER_SAMPLE
"""Between two images of the led camera [s] (30 Hz)."""
_TICKS_PER_FRAME = 3
"""Of a trial's log, when onlookers are to see each image at its time."""


class ShownSource:
    """A region source that is shown images beside everything else, and what it made of them."""

    def __init__(self, name: str, config: TrialConfig, station: SimulationStation, terrain):
        """``station``: whose images it will see; ``name``: of the source, the settings of which are in ``config``."""
        stages: QuadpipsConfig = config.stages
        entry = region_sources.get(name)
        self.name, self.timings = name, StageTimings()
        setup = RegionSourceSetup(
            robot=station.robot,
            terrain=terrain,
            intrinsics=station.camera_intrinsics,
            config=stages.section(entry),
            camera=stages.station.camera_name,
            further_cameras=tuple(stages.station.further_cameras),
            seed=config.seed,
            timings=self.timings,
            images=stages.perception,
        )
        self.system: System = entry.factory(setup)
        self._simulator = Simulator(self.system)
        self._frames = 0

    @property
    def context(self):
        """Of the source, by itself."""
        return self._simulator.get_mutable_context()

    def show(self, station: SimulationStation, context, state: RobotState) -> None:
        """Shows the next frame: what ``station`` has in ``context``, at the robot's (estimated) ``state``."""
        for port in input_names(self.system):
            if port == "robot_state":
                value = AbstractValue.Make(state)
            elif station.HasOutputPort(port):
                shown = station.GetOutputPort(port).Eval(context)
                value = Value(shown) if isinstance(shown, ImageDepth32F) else AbstractValue.Make(shown)
            else:
                continue
            self.system.GetInputPort(port).FixValue(self.context, value)
        if self._frames == 0:
            self._simulator.Initialize()
        self._frames += 1
        self._simulator.AdvanceTo(self._frames * FRAME_PERIOD)


def score_walk(
    config: TrialConfig, sources: Sequence[str] = (), progress: Callable[[float], None] | None = None
) -> tuple[dict[str, PerceptionScorer], dict]:
    """Lets the whole system walk and scores what its region source says meanwhile, and others that see the same images.

    Args:
        config: of the trial.
        sources: the region sources to score; the robot walks by the first. Default: that of ``config``.
        progress: called with the simulated time [s] now and then.

    Returns: the scorers by source, and how the trial ended (reason, detail, sim_time, timings_ms).
    """
    first, *others = sources or [config.stages.region_source]
    config = replace(config, stages=replace(config.stages, region_source=first))
    if others:
        config = replace(config, log_rate=_TICKS_PER_FRAME / FRAME_PERIOD)
    trial = Trial(config)
    scorers = {name: _scorer(config, trial.terrain) for name in (first, *others)}
    onlookers = [ShownSource(name, config, trial.diagram.station, trial.terrain) for name in others]
    ticks = [0]

    def look(trial: Trial):
        time, station = trial.context.get_time(), trial.diagram.station
        of_station, of_regions = (s.GetMyContextFromRoot(trial.context) for s in (station, trial.diagram.regions))
        if onlookers and ticks[0] % _TICKS_PER_FRAME == 0:
            state = trial.diagram.GetOutputPort("robot_state").Eval(trial.context)
            for onlooker in onlookers:
                onlooker.show(station, of_station, state)
        ticks[0] += 1
        last = scorers[first].rows[-1]["t"] if scorers[first].rows else -np.inf
        if time - last > SAMPLE_PERIOD - 1e-6:
            X_WO = drifted_world(time, config.seed, config.stages.drift)
            moment = _Moment(config, time, X_WO, station, of_station)
            scorers[first].add(moment.sample(trial.diagram.regions, of_regions))
            for onlooker in onlookers:
                scorers[onlooker.name].add(moment.sample(onlooker.system, onlooker.context))

    verdict = trial.run(progress, look)
    ended = {
        "reason": verdict.reason,
        "detail": verdict.detail,
        "sim_time": round(trial.context.get_time(), 3),
        "timings_ms": _merged(trial.timings, onlookers),
    }
    return scorers, ended


def score_camera_path(
    config: TrialConfig,
    sources: Sequence[str] = (),
    progress: Callable[[float], None] | None = None,
    *,
    speed: float = 0.5,
) -> tuple[dict[str, PerceptionScorer], dict]:
    """Leads a rigid robot from start to goal, swaying as if it walked, and scores perception alone; without physics.

    Args:
        config: as for a trial; planning and tracking are not used.
        sources: the region sources to score. Default: that of ``config``.
        progress: called with the scripted time [s] now and then.
        speed: [m/s].
    """
    terrain = load_terrain(
        config.terrain, config.seed, config.start or None, config.goal or None, difficulty=config.difficulty
    )
    station = SimulationStation(load_robot(config.robot), terrain, config.stages.station)
    onlookers = [ShownSource(name, config, station, terrain) for name in sources or [config.stages.region_source]]
    scorers, time = {onlooker.name: _scorer(config, terrain) for onlooker in onlookers}, 0.0
    for moment in _camera_path(config, terrain, station, speed, onlookers):
        for onlooker in onlookers:
            scorers[onlooker.name].add(moment.sample(onlooker.system, onlooker.context))
        time = moment.time
        if progress is not None:
            progress(time)
    return scorers, {
        "reason": "path_ended",
        "detail": f"camera led at {speed:g} m/s",
        "sim_time": time,
        "timings_ms": _merged(StageTimings(), onlookers),
    }


def _merged(timings: StageTimings, onlookers: Sequence[ShownSource]) -> dict:
    """Computing times of a trial and of its onlookers."""
    merged = timings.summary_ms()
    for onlooker in onlookers:
        merged |= {name: times for name, times in onlooker.timings.summary_ms().items() if name not in merged}
    return merged


def _scorer(config: TrialConfig, terrain) -> PerceptionScorer:
    return PerceptionScorer(terrain, 2.0 / config.stages.perception.egocan.v_fov)


def _camera_path(
    config: TrialConfig, terrain, station: SimulationStation, speed: float, onlookers: Sequence[ShownSource]
) -> Iterator["_Moment"]:
    """Yields a moment every SAMPLE_PERIOD along the way from start to goal, when all ``onlookers`` have seen it."""
    context = station.CreateDefaultContext()
    for k, state in enumerate(swaying_states(station.robot, terrain, speed)):
        context.SetTime(state.stamp)
        plant_context = station.plant.GetMyMutableContextFromRoot(context)
        station.robot.set_state(station.plant, plant_context, state.p_WB, state.rpy_WB, state.joint_positions)
        X_WO = drifted_world(state.stamp, config.seed, config.stages.drift)
        estimate = drift_state(state, X_WO) if config.stages.drift.enabled else state
        for onlooker in onlookers:
            onlooker.show(station, context, estimate)
        if k % _FRAMES_PER_SAMPLE == 0:
            yield _Moment(config, state.stamp, X_WO, station, context)


class _Moment:
    """What is true at one time, for samples of what several sources say then."""

    def __init__(self, config: TrialConfig, time: float, X_WO: np.ndarray, station: SimulationStation, context):
        self.time, self._config, self._X_WO, self._intrinsics = time, config, X_WO, station.camera_intrinsics
        self._X_WC = station.GetOutputPort("camera_pose").Eval(context).GetAsMatrix4()
        self._true_depth = station.GetOutputPort("depth_image").Eval(context).data[:, :, 0].copy()

    def sample(self, source: System, context) -> PerceptionSample:
        """What the region ``source`` says in its ``context``."""
        p_OC = self._X_WO[:3, :3].T @ (self._X_WC[:3, 3] - self._X_WO[:3, 3])
        return PerceptionSample(
            stamp=self.time,
            X_WC=self._X_WC,
            true_depth=self._true_depth,
            intrinsics=self._intrinsics,
            X_WO=self._X_WO,
            floor=_floor_of(source, context, self._config.stages, p_OC),
            regions=source.GetOutputPort("region_set").Eval(context),
        )


def _floor_of(source: System, context, stages: QuadpipsConfig, p_OC: np.ndarray) -> Floor:
    """The floor of a region ``source`` around the camera at ``p_OC`` [m], if it is one that has a floor."""
    if source.HasOutputPort("egocan"):
        can = source.GetOutputPort("egocan").Eval(context)
        superpixels = segment_superpixels(can, stages.perception.superpixels)
        points = superpixels.points
        with np.errstate(invalid="ignore"):
            floor = (superpixels.assignment >= 0) & (np.hypot(points[..., 0], points[..., 2]) < FLOOR_RADIUS)
        R_OE, p_OE = can.X_WE[:3, :3], can.X_WE[:3, 3]
        return Floor(points[floor] @ R_OE.T + p_OE, can.cap_normals[floor] @ R_OE.T)
    if source.HasOutputPort("elevation_map"):
        elevation = source.GetOutputPort("elevation_map").Eval(context)
        planes = with_preset(stages.elevation.planes, stages.elevation.preset)
        layers = filter_map(elevation, planes)
        if layers is None:
            return Floor()
        i, j = np.nonzero(find_planes(layers, planes)[0] >= 0)
        places = layers.corner + layers.pitch * (np.column_stack([i, j]) + 0.5)
        near = np.hypot(*(places - p_OC[:2]).T) < FLOOR_RADIUS
        i, j, places = i[near], j[near], places[near]
        normals = np.column_stack([-layers.slopes[i, j], np.ones(len(i))])
        return Floor(
            np.column_stack([places, layers.height[i, j]]), normals / np.linalg.norm(normals, axis=1, keepdims=True)
        )
    return Floor()


def check_sources(names: Sequence[str]) -> None:
    """Raises UserInputError unless ``names`` are different region sources."""
    for name in names:
        region_sources.get(name)
    if len(set(names)) < len(names):
        raise UserInputError(f"--regions {','.join(names)}: one of them comes twice")


def swaying_states(robot, terrain, speed: float) -> Iterator[RobotState]:
    """Yields the states (30 Hz) of a rigid robot that is led over ``terrain`` at ``speed`` [m/s], bobbing and swaying."""
    truth, start, goal = GroundTruth(terrain), np.array(terrain.start[:2]), np.array(terrain.goal)
    yaw = np.arctan2(*(goal - start)[::-1])
    _, joints = standing_pose(robot, truth, *terrain.start)
    blank = vars(RobotState.empty())
    for k in range(int(np.linalg.norm(goal - start) / speed / FRAME_PERIOD) + 1):
        t = k * FRAME_PERIOD
        x, y = start + (goal - start) * (speed * t / np.linalg.norm(goal - start))
        ahead = np.linspace(-0.6, 0.6, 13)
        ground = truth.nearest_walkable_height(x + ahead * np.cos(yaw), y + ahead * np.sin(yaw)).mean()
        rpy = np.array([0.02 * np.sin(7 * t), 0.035 * np.sin(4 * np.pi * t), yaw + 0.05 * np.sin(0.9 * t)])
        p_WB = np.array([x, y + 0.03 * np.sin(3 * t), ground + robot.nominal_base_height + 0.02 * np.sin(10.7 * t)])
        R_WB = RollPitchYaw(rpy).ToRotationMatrix().matrix()
        yield RobotState(**{**blank, "stamp": t, "p_WB": p_WB, "rpy_WB": rpy, "R_WB": R_WB, "joint_positions": joints})
