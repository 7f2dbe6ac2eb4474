"""The configuration of a trial, out of the robot's defaults, a file, options and overrides."""

from dataclasses import field, fields, make_dataclass
from pathlib import Path
from typing import Any

from quadpips_drake.configuration.layers import ConfigLayer, override_layer, read_layer
from quadpips_drake.configuration.loading import load_config
from quadpips_drake.diagrams.planners import planners
from quadpips_drake.robots.robot_library import DEFAULT_ROBOT, load_robot, robot_defaults_layer, robot_file, robots
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.robots.stage_latencies import latency_layer
from quadpips_drake.terrain.library import terrain_cameras
from quadpips_drake.trials.simulated_trial import SimulationConfig


def default_stages(
    stages: type,
    robot: str,
    latency: str = "zero",
    latency_scale: float = 1.0,
    terrain: str = "",
    wishes: ConfigLayer | None = None,
):
    """Returns the configuration of all stages for a robot: here, and nowhere else, a robot's own numbers come in.

    Args:
        stages: QuadpipsConfig (or what ``stages_type`` made of it) or WalkConfig.
        robot: name, or path of its robot.yaml.
        latency: preset of the stages' latencies, see ``robots.stage_latencies``.
        latency_scale: factor on these latencies.
        terrain: name of where it walks; the robot gets the cameras that it needs there, if it has them.
        wishes: what the planner wants otherwise, see ``planner_wishes``.
    """
    layers = robot_defaults_layer(robot), latency_layer(latency, robot, latency_scale), _camera_layer(terrain, robot)
    asked = [] if wishes is None else [wishes]
    return load_config(stages, [*(_known(layer, stages) for layer in layers), *asked])


def planner_wishes(planner: str) -> ConfigLayer:
    """What a planner wants otherwise than the defaults in code, keys as below ``stages``; all else is the same for all.

    Raises:
        UserInputError: there is no such planner.
    """
    return ConfigLayer(f"what the planner '{planner}' wants", planners.get(planner).wishes)


def _camera_layer(terrain: str, robot: str) -> ConfigLayer:
    """The cameras beside the front one that a terrain asks for, as far as the robot has them."""
    wanted = terrain_cameras(terrain)
    names = [camera.name for camera in load_robot(robot).cameras if camera.name in wanted] if wanted else []
    return ConfigLayer(f"the cameras for '{terrain}'", {"station": {"further_cameras": names}} if names else {})


def _known(layer: ConfigLayer, stages: type) -> ConfigLayer:
    """The sections of a layer that ``stages`` has: a walk has fewer than a run."""
    known = {entry.name for entry in fields(stages)}
    return ConfigLayer(layer.source, {key: value for key, value in layer.data.items() if key in known})


def resolve_config(schema: type, scenario: Path | None, options: dict, sets: list[str]):
    """Lays the robot's defaults, the scenario file, the options and the ``--set`` overrides over the defaults in code.

    Args:
        schema: TrialConfig or WalkTrialConfig.
        scenario: YAML file, or None.
        options: top-level keys of the schema, as on the command line.
        sets: texts of the form key=value.

    Returns: the configuration.

    Raises:
        UserInputError: something in them is unknown or of the wrong type.
    """
    layers = [read_layer(scenario)] if scenario else []
    layers += [ConfigLayer("--" + key, {key: value}) for key, value in options.items()]
    layers += [override_layer(text) for text in sets]
    robot = _last(layers, "robot") or DEFAULT_ROBOT
    wishes = schema.wishes(_last(layers, "planner"))
    stages = _stages_type(schema, [wishes.under("stages"), *layers])
    layers = _with_presets(layers, schema, stages, robot)
    if stages is not schema.stages_type():
        schema = make_dataclass(schema.__name__, [("stages", stages, field(default=None))], bases=(schema,))
    terrain = _last(layers, "terrain") or schema.terrain
    own = default_stages(stages, robot, schema.latency, schema.latency_scale, terrain, wishes)
    return load_config(schema, layers, base=schema(robot=robot, stages=own))


def _with_presets(layers: list[ConfigLayer], schema: type, stages: type, robot: str) -> list[ConfigLayer]:
    """The layers, each that asks for latencies preceded by these: what it says of single stages itself counts more."""
    preset, scale, result = schema.latency, schema.latency_scale, []
    for layer in layers:
        data = layer.data if isinstance(layer.data, dict) else {}
        if "latency" in data or "latency_scale" in data:
            preset, scale = data.get("latency", preset), data.get("latency_scale", scale)
            load_config(SimulationConfig, [ConfigLayer(layer.source, {"latency": preset, "latency_scale": scale})])
            asked = _known(latency_layer(preset, robot, scale), stages)
            result.append(ConfigLayer(asked.source, {"stages": asked.data}))
        result.append(layer)
    return result


def load_trial_config(
    schema: type, *, robot: str | RobotModel | None = None, file: str | Path | None = None, sets: tuple = (), **options: Any
):
    """The same for callers in Python; see ``quadpips_drake.load_config``."""
    if isinstance(robot, RobotModel):
        known = robot.name in robots and robot_file(robot.name) == robot.description_path
        robot = robot.name if known else str(robot.description_path)
    if robot is not None:
        options["robot"] = robot
    return resolve_config(schema, Path(file) if file else None, options, list(sets))


def _stages_type(schema: type, layers: list[ConfigLayer]) -> type:
    """The type of the stages with the sections of a planner, region source and state estimator from outside the package."""
    chosen = {key: _last(layers, *path) for key, path in schema.choices().items()}
    return schema.stages_type(**{key: name for key, name in chosen.items() if name})


def _last(layers: list[ConfigLayer], *path: str) -> str | None:
    """The last text that the layers have at a key; whatever else stands there is refused later."""
    found = None
    for layer in layers:
        value = layer.data
        for name in path:
            value = value.get(name) if isinstance(value, dict) else None
        found = value if isinstance(value, str) else found
    return found
