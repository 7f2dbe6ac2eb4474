"""What is known of a trial that is over: from the trial itself, or from the files that it has left."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.trials.result import TrialResult
from quadpips_drake.trials.simulated_trial import SimulationConfig

RESULT, LOG, CONFIG = "result.json", "log.npz", "config.yaml"


@dataclass(frozen=True, eq=False)
class TrialRecord:
    """A trial that is over."""

    folder: Path
    """Where its files are."""
    result: TrialResult
    log: Mapping[str, np.ndarray]
    """Arrays of log.npz; empty where there is none."""
    robot: RobotModel | None
    terrain: Terrain | None
    """As it was at the beginning; None where it cannot be had any more."""
    config: SimulationConfig | None
    remarks: tuple[str, ...] = ()
    """What could not be had, and why."""

    @property
    def is_walk(self) -> bool:
        """Whether it was a walk by velocity command."""
        return not self.result.planner

    @property
    def name(self) -> str:
        """What it is called beside others."""
        return self.folder.name or str(self.folder.absolute().name)

    @property
    def tells_what_was_asked(self) -> bool:
        """Whether the log says so: one of an earlier version does not."""
        return "asked_contacts" in self.log and len(self.log["time"]) > 0

    def setting(self, path: str, default=None):
        """The value at a dotted key of the configuration; ``default`` where there is none."""
        value = self.config
        for key in path.split("."):
            value = getattr(value, key, None)
        return default if value is None else value


def record_of(trial, result: TrialResult, folder: Path) -> TrialRecord:
    """The record of a SimulatedTrial that has just ended."""
    log = trial.log.arrays() if len(trial.log) else {}
    return TrialRecord(Path(folder), result, log, trial.robot, trial.terrain, trial.config)
