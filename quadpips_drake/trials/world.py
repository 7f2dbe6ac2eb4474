"""The robot and the terrain of a trial: loaded by name or file, or given as objects."""

from dataclasses import replace

from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.terrain import Terrain


def world_of(config, robot: RobotModel | None, terrain: Terrain | None) -> tuple[RobotModel, Terrain]:
    """Returns the robot and the terrain of a trial, start and goal as its configuration wants them.

    Args:
        config: TrialConfig or WalkTrialConfig.
        robot: the robot; None: the one that the configuration names.
        terrain: the world; None: the one that the configuration names.

    Raises:
        UserInputError: a name is unknown, a file is broken, or the configuration is for another robot.
    """
    named = load_robot(config.robot)
    if robot is not None and robot.name != named.name:
        raise UserInputError(
            f"the configuration is for the robot '{named.name}', not '{robot.name}': make it with load_config(robot=...)"
        )
    goal = getattr(config, "goal", None)
    if terrain is None:
        return robot or named, load_terrain(
            config.terrain, config.seed, config.start or None, goal or None, difficulty=config.difficulty
        )
    if config.difficulty is not None:
        raise UserInputError("difficulty: the terrain was given as an object; make that as hard as it shall be")
    changes = {"start": config.start} if config.start else {}
    return robot or named, replace(terrain, **changes, **({"goal": goal} if goal else {}))
