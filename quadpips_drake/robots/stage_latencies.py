"""Computing time as simulated time: presets that say when each stage's results are there.

A preset is a YAML file with rates and latencies of stages, keys as below ``stages`` in config.yaml. All presets set the same
keys, so that one replaces another completely.
"""

from importlib.resources import files
from pathlib import Path
from typing import Any

from quadpips_drake.configuration.layers import ConfigLayer, read_layer
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.robots.robot_library import DEFAULT_ROBOT, robot_file

MEASURED = "measured"
"""The preset that each robot has for itself: what ``quadpips evaluate latency`` measured with it."""
_COMMON = {
    path.stem: path for path in sorted((Path(str(files("quadpips_drake.robots"))) / "latency_presets").glob("*.yaml"))
}
PRESETS = (*_COMMON, MEASURED)
"""Names of all presets."""
MEASURED_FILE = "latency.yaml"
"""Beside a robot's robot.yaml; a robot that has none is taken to compute as long as the default one."""


def latency_layer(preset: str, robot: str, scale: float = 1.0) -> ConfigLayer:
    """Returns rates and latencies of the stages, keys as below ``stages``.

    Args:
        preset: one of PRESETS, or the path of a file.
        robot: name of the robot, or path of its robot.yaml.
        scale: factor on all latencies [1].

    Raises:
        UserInputError: there is no such preset.
    """
    path = _preset_file(preset, robot)
    source = f"the latencies '{preset}'" + ("" if scale == 1.0 else f" times {scale:g}")
    return ConfigLayer(source, _scaled(read_layer(path).data, scale))


def _preset_file(preset: str, robot: str) -> Path:
    if preset in _COMMON:
        return _COMMON[preset]
    if preset == MEASURED:
        own = robot_file(robot).parent / MEASURED_FILE
        return own if own.is_file() else robot_file(DEFAULT_ROBOT).parent / MEASURED_FILE
    if Path(preset).suffix in (".yaml", ".yml"):
        if not Path(preset).is_file():
            raise UserInputError(f"latency '{preset}': there is no such file; the presets are {', '.join(PRESETS)}")
        return Path(preset)
    raise unknown_name("latency", preset, PRESETS)


def _scaled(data: Any, scale: float) -> Any:
    """The tree with every ``latency`` in it multiplied."""
    if not isinstance(data, dict):
        return data
    return {
        key: value * scale if key == "latency" and isinstance(value, int | float) else _scaled(value, scale)
        for key, value in data.items()
    }
