"""The configuration of a trial, out of the robot's defaults, a file, options and overrides."""

from dataclasses import fields
from pathlib import Path

from quadpips_drake.configuration.layers import ConfigLayer, override_layer, read_layer, robot_defaults_layer
from quadpips_drake.configuration.loading import load_config
from quadpips_drake.errors import unknown_name
from quadpips_drake.robots.robot_model import robot_names


def resolve_config(schema: type, scenario: Path | None, options: dict, sets: list[str]):
    """Lays the robot's defaults, the scenario file, the options and the ``--set`` overrides over the defaults in code.

    Args:
        schema: TrialConfig or WalkTrialConfig.
        scenario: YAML file, or None.
        options: top-level keys of the schema.
        sets: texts of the form key=value.

    Returns: the configuration.

    Raises:
        UserInputError: something in them is unknown or of the wrong type.
    """
    layers = [read_layer(scenario)] if scenario else []
    layers += [ConfigLayer("--" + key, {key: value}) for key, value in options.items()]
    layers += [override_layer(text) for text in sets]
    config = load_config(schema, layers)
    if config.robot not in robot_names():
        raise unknown_name("robot", config.robot, robot_names())
    defaults = robot_defaults_layer(config.robot)
    stages = {field.name for field in fields(config.stages)}  # a walk has fewer than a run
    own = ConfigLayer(defaults.source, {key: value for key, value in defaults.data.items() if key in stages})
    return load_config(schema, [own.under("stages"), *layers])
