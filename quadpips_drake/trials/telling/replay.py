"""A trial that is over, to be looked at again: its files, and a station that is put to any moment of its log."""

import zipfile
from pathlib import Path

import numpy as np
from pydrake.math import RollPitchYaw

from quadpips_drake.diagrams.simulation_station import SimulationStation
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.plain_yaml import read_yaml
from quadpips_drake.trials.loading import load_config, load_walk_config
from quadpips_drake.trials.spawning.spawner import parse_spawns
from quadpips_drake.trials.world import world_of
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.visualization.overlay.story import Story

_NEEDED = ("time", "p_WB", "rpy_WB", "v_WB", "w_WB", "joint_positions", "joint_velocities", "foot_positions", "contacts")


class TrialFiles:
    """What a run or a walk has left in a directory."""

    def __init__(self, directory: Path):
        """Reads it; raises UserInputError where there is no trial, or not all of it."""
        self.directory = Path(directory)
        for name in ("config.yaml", "log.npz", "result.json"):
            if not (self.directory / name).is_file():
                raise UserInputError(f"{directory}: there is no {name} in it; give the directory of a run or a walk")
        self.is_walk = "gait" in read_yaml(self.directory / "config.yaml")
        self.config = (load_walk_config if self.is_walk else load_config)(file=self.directory / "config.yaml")
        self.result = read_json(self.directory / "result.json")
        self.log = _read_log(self.directory / "log.npz")
        there = (self.directory / "story.json").is_file()
        self.story = Story.load(self.directory / "story.json") if there else self._short_story()

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(self.log["time"][-1])

    def index(self, time: float) -> int:
        """The sample at ``time`` [s] or the next one."""
        return int(np.searchsorted(self.log["time"], time - 1e-9).clip(0, len(self.log["time"]) - 1))

    def _short_story(self) -> Story:
        """What the result says, for trials of before there were stories."""
        reason, detail = str(self.result.get("reason", "")).replace("_", " "), self.result.get("detail", "")
        title = f"{self.result.get('robot', '')} on {self.result.get('terrain', '')}"
        return Story(title, verdict=f"{reason}: {detail}" if detail else reason, end=self.end)


class Replay:
    """A station like that of the trial, which shows one moment after the other."""

    def __init__(self, files: TrialFiles):
        """Builds it; contexts are made by the caller, who may add to its scenes before."""
        self.files = files
        config = files.config
        robot, self.terrain = world_of(config, None, None)
        spawns = parse_spawns(getattr(config, "spawn", []), config.duration)
        appearing = tuple(element for spawn in spawns for element in spawn.elements)
        self.station = SimulationStation(robot, self.terrain, config.stages.station, appearing=appearing, seed=config.seed)
        self.robot = self.station.robot

    def go_to(self, context, time: float) -> RobotState:
        """Puts robot and world to what they were at ``time`` [s]; returns the robot's state."""
        state = robot_state_at(self.files.log, self.files.index(time))
        attitude = RollPitchYaw(state.rpy_WB).ToQuaternion().wxyz()
        position = np.concatenate((attitude, state.p_WB, state.joint_positions))
        velocity = np.concatenate((state.w_WB, state.v_WB, state.joint_velocities))
        plant = self.station.plant
        robot = plant.GetModelInstanceByName(self.robot.name)
        plant_context = plant.GetMyMutableContextFromRoot(context)
        plant.SetPositionsAndVelocities(plant_context, robot, np.concatenate((position, velocity)))
        for number, at, X_WE in self.files.story.at("appeared", time, ()):
            if at <= time + 1e-9:
                self.station.let_appear(context, int(number), np.reshape(X_WE, (4, 4)))
        return state


def robot_state_at(log: dict, k: int) -> RobotState:
    """The RobotState of the sample ``k`` of a log."""
    return RobotState(
        stamp=float(log["time"][k]),
        p_WB=log["p_WB"][k],
        rpy_WB=log["rpy_WB"][k],
        R_WB=rotation_from_rpy(log["rpy_WB"][k]),
        v_WB=log["v_WB"][k],
        w_WB=log["w_WB"][k],
        joint_positions=log["joint_positions"][k],
        joint_velocities=log["joint_velocities"][k],
        joint_torques=log["joint_torques"][k],
        contact_forces=log["contact_forces"][k],
        contacts=log["contacts"][k],
    )


def _read_log(path: Path) -> dict[str, np.ndarray]:
    try:
        with np.load(path, allow_pickle=False) as arrays:
            log = dict(arrays)
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise UserInputError(f"{path}: this is no log of a trial ({error}); run the trial again") from None
    missing = [name for name in _NEEDED if name not in log]
    if missing or not len(log["time"]):
        raise UserInputError(f"{path}: {', '.join(missing) or 'not a single sample'} is missing; run the trial again")
    return log
