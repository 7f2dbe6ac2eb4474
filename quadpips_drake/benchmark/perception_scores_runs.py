"""Where the samples for the scores of perception come from: the whole system walking, or a camera led along a path."""

from collections.abc import Callable, Iterator

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RollPitchYaw
from pydrake.systems.analysis import Simulator

from quadpips_drake.benchmark.perception_scores import PerceptionSample, PerceptionScorer
from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.diagrams.simulation_station import SimulationStation
from quadpips_drake.errors import UserInputError
from quadpips_drake.estimation.pose_drift import drift_state, drifted_world
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


def score_walk(config: TrialConfig, progress: Callable[[float], None] | None = None) -> tuple[PerceptionScorer, dict]:
    """Lets the whole system walk and scores what its perception says meanwhile.

    Args:
        config: of the trial; its regions must come from the camera.
        progress: called with the simulated time [s] now and then.

    Returns: the scorer, and how the trial ended (reason, detail, sim_time, timings_ms).
    """
    if config.stages.region_source != "superpixels":
        raise UserInputError("evaluate perception: stages.region_source must be superpixels, to have something to score")
    trial = Trial(config)
    scorer = PerceptionScorer(trial.terrain, config.stages.perception.superpixels)

    def sample(time: float):
        last = scorer.rows[-1]["t"] if scorer.rows else -np.inf
        if time - last > SAMPLE_PERIOD - 1e-6:
            scorer.add(_sample_trial(trial))
        if progress is not None:
            progress(time)

    verdict = trial.run(sample)
    ended = {
        "reason": verdict.reason,
        "detail": verdict.detail,
        "sim_time": round(trial.context.get_time(), 3),
        "timings_ms": trial.timings.summary_ms(),
    }
    return scorer, ended


def _sample_trial(trial: Trial) -> PerceptionSample:
    context, station = trial.context, trial.diagram.station
    perception = trial.diagram.GetSubsystemByName("perception")
    of_station = station.GetMyContextFromRoot(context)
    of_perception = perception.GetMyContextFromRoot(context)
    seed, drift = trial.config.seed, trial.config.stages.drift
    return PerceptionSample(
        stamp=context.get_time(),
        X_WC=station.GetOutputPort("camera_pose").Eval(of_station).GetAsMatrix4(),
        true_depth=station.GetOutputPort("depth_image").Eval(of_station).data[:, :, 0].copy(),
        intrinsics=station.camera_intrinsics,
        X_WO=drifted_world(context.get_time(), seed, drift),
        can=perception.GetOutputPort("egocan").Eval(of_perception),
        regions=perception.GetOutputPort("region_set").Eval(of_perception),
    )


def score_camera_path(
    config: TrialConfig, *, speed: float = 0.5, progress: Callable[[float], None] | None = None
) -> tuple[PerceptionScorer, dict]:
    """Leads a rigid robot from start to goal, swaying as if it walked, and scores perception alone; without physics.

    Args:
        config: as for a trial; planning and tracking are not used.
        speed: [m/s].
        progress: called with the scripted time [s] now and then.
    """
    terrain = load_terrain(
        config.terrain, config.seed, config.start or None, config.goal or None, difficulty=config.difficulty
    )
    timings = StageTimings()
    scorer = PerceptionScorer(terrain, config.stages.perception.superpixels)
    for sample in camera_path(config, terrain, speed, timings):
        scorer.add(sample)
        if progress is not None:
            progress(sample.stamp)
    return scorer, {
        "reason": "path_ended",
        "detail": f"camera led at {speed:g} m/s",
        "sim_time": scorer.rows[-1]["t"],
        "timings_ms": timings.summary_ms(),
    }


def camera_path(config: TrialConfig, terrain, speed: float, timings: StageTimings) -> Iterator[PerceptionSample]:
    """Yields a sample every SAMPLE_PERIOD along the way from start to goal; perception is the same diagram as in a trial."""
    stages = config.stages
    station = SimulationStation(load_robot(config.robot), terrain, stages.station)
    further, intrinsics = stages.station.further_cameras, station.camera_intrinsics
    cameras = {"camera": stages.station.camera_name, "further_cameras": further}
    perception = PerceptionModule(station.robot, intrinsics, stages.perception, timings, **cameras, seed=config.seed)
    context, simulator = station.CreateDefaultContext(), Simulator(perception)
    of_perception = simulator.get_mutable_context()
    for k, state in enumerate(swaying_states(station.robot, terrain, speed)):
        context.SetTime(state.stamp)
        plant_context = station.plant.GetMyMutableContextFromRoot(context)
        station.robot.set_state(station.plant, plant_context, state.p_WB, state.rpy_WB, state.joint_positions)
        for port in ("depth_image", *(f"depth_image_{name}" for name in further)):
            image = station.GetOutputPort(port).Eval(context)
            perception.GetInputPort(port).FixValue(of_perception, Value(image))
        X_WO = drifted_world(state.stamp, config.seed, stages.drift)
        estimate = drift_state(state, X_WO) if stages.drift.enabled else state
        perception.GetInputPort("robot_state").FixValue(of_perception, AbstractValue.Make(estimate))
        if k == 0:
            simulator.Initialize()
        simulator.AdvanceTo((k + 1) * FRAME_PERIOD)
        if k % _FRAMES_PER_SAMPLE:
            continue
        yield PerceptionSample(
            stamp=state.stamp,
            X_WC=station.GetOutputPort("camera_pose").Eval(context).GetAsMatrix4(),
            true_depth=station.GetOutputPort("depth_image").Eval(context).data[:, :, 0].copy(),
            intrinsics=intrinsics,
            X_WO=X_WO,
            can=perception.GetOutputPort("egocan").Eval(of_perception),
            regions=perception.GetOutputPort("region_set").Eval(of_perception),
        )


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
