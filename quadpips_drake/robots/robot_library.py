"""The robots by name or by file, and what each needs otherwise than the defaults in code."""

import dataclasses
from functools import cache
from importlib.resources import files
from pathlib import Path

from quadpips_drake.configuration.layers import ConfigLayer, read_layer
from quadpips_drake.configuration.loading import load_config
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.registry import Registry
from quadpips_drake.robots.robot_description import RobotDescription
from quadpips_drake.robots.robot_model import RobotModel, read_model

_MODELS = Path(str(files("quadpips_drake.models")))
_DESCRIPTION, _DEFAULTS = "robot.yaml", "defaults.yaml"
DEFAULT_ROBOT = "anymal_c"
"""The one that is meant where none is named."""

robots = Registry("robot", "quadpips_drake.robots")
"""``factory()`` returns the path of the robot's robot.yaml; its URDF and its defaults.yaml lie beside it."""

for _folder in sorted(_MODELS.iterdir()):
    if (_folder / _DESCRIPTION).is_file():
        robots.add(_folder.name, lambda folder=_folder: folder / _DESCRIPTION)


def robot_names() -> list[str]:
    """Returns the names of all robots: those that come with this package and those of others."""
    return robots.names()


def robot_file(robot: str | Path) -> Path:
    """Returns the path of the robot.yaml behind a name, or of a file itself.

    Raises:
        UserInputError: there is no robot of that name, or no such file.
    """
    text = str(robot)
    if text not in robots and (Path(text).suffix in (".yaml", ".yml") or "/" in text):
        path = Path(text)
        if path.is_dir():
            path = path / _DESCRIPTION
        if not path.exists():
            raise UserInputError(f"robot '{text}': there is no such file; give a name or the path of a {_DESCRIPTION}")
        return path.resolve()
    return Path(robots.get(text).factory())


def load_robot(robot: str | Path) -> RobotModel:
    """Loads a robot by name, or from its robot.yaml (see docs/extending.md for what is in it).

    Raises:
        UserInputError: there is none of that name, or its files are not as they must be.
    """
    return _load(robot_file(robot))


@cache
def _load(path: Path) -> RobotModel:
    description = load_config(RobotDescription, [read_layer(path)])
    name = description.name or (path.parent.name if path.name == _DESCRIPTION else path.stem)
    urdf = path.parent / description.urdf
    if not description.urdf or not urdf.is_file():
        raise UserInputError(f"{path}: 'urdf' must name the robot's URDF beside this file, not '{description.urdf}'")
    try:
        return dataclasses.replace(read_model(name, urdf, description), description_path=path)
    except UserInputError as error:
        raise UserInputError(f"{path}: {error}") from None
    except (RuntimeError, ValueError, SystemExit) as error:  # whatever Drake does not like about it
        raise UserInputError(f"{urdf}: cannot be used as a robot: {' '.join(str(error).split())[:300]}") from None


def robot_defaults_layer(robot: str | Path) -> ConfigLayer:
    """Returns the defaults.yaml beside the robot's robot.yaml (sections as below ``stages``); empty if there is none."""
    path = robot_file(robot).parent / _DEFAULTS
    source = f"models/{robot}/{_DEFAULTS}" if path.is_relative_to(_MODELS) else str(path)
    return dataclasses.replace(read_layer(path), source=source) if path.is_file() else ConfigLayer(source, {})
