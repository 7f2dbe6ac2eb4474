"""Configurations for callers in Python: the same layers as on the command line."""

from pathlib import Path

from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.trials.trial import TrialConfig
from quadpips_drake.trials.trial_options import load_trial_config
from quadpips_drake.trials.walk_trial import WalkTrialConfig


def load_config(
    robot: str | RobotModel | None = None, *, file: str | Path | None = None, sets: tuple = (), **options
) -> TrialConfig:
    """Returns the configuration of a run: defaults in code, the robot's, a file, options and overrides, in this order.

    Args:
        robot: name, path of a robot.yaml, or a robot that was loaded; default: the file's, else anymal_c.
        file: YAML file with any of the keys of a saved config.yaml.
        sets: texts such as "stages.planning.footholds.gait=standing_walk".
        options: keys of TrialConfig: ``terrain``, ``planner``, ``seed``, ``start``, ``goal``, ``duration``, ...

    Raises:
        UserInputError: something is unknown, of the wrong type or out of its range.
    """
    return load_trial_config(TrialConfig, robot=robot, file=file, sets=tuple(sets), **options)


def load_walk_config(
    robot: str | RobotModel | None = None, *, file: str | Path | None = None, sets: tuple = (), **options
) -> WalkTrialConfig:
    """Returns the configuration of a walk by velocity command; as ``load_config``, with the keys of WalkTrialConfig."""
    return load_trial_config(WalkTrialConfig, robot=robot, file=file, sets=tuple(sets), **options)
