"""Layers of configuration: what they make together, and what is said when one is wrong."""

from dataclasses import field

import pytest

from quadpips_drake.configuration.layers import ConfigLayer, override_layer, read_layer
from quadpips_drake.configuration.loading import load_config, save_config
from quadpips_drake.configuration.schema import config_keys, configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import robot_defaults_layer, robot_names
from tests.configuration.classes import configuration_classes


@configuration
class SolverConfig:
    """An inner section."""

    horizon: float = ranged(1.0, 1e-3, 1000.0)
    """[s]"""
    knots: int = ranged(20, 1, 100)
    weights: list[float] = ranged([1.0, 2.0], 0.0, 100.0, lengths=range(10))
    """[-]"""

    def __post_init__(self):
        if self.knots > 20 and self.horizon < 2.0:
            raise UserInputError("too many knots")


@configuration
class StagesConfig:
    """A section of sections."""

    mpc: SolverConfig = field(default_factory=SolverConfig)
    swing: SolverConfig = field(default_factory=lambda: SolverConfig(horizon=0.5))


@configuration
class ChangeConfig:
    """An item of a list."""

    time: float = ranged(0.0, 0.0, 10.0)
    """[s]"""


@configuration
class RootConfig:
    """The whole."""

    seed: int = ranged(0, 0, 1000)
    name: str = "flat"
    fast: bool = False
    goal: list[float] | None = ranged(None, -100.0, 100.0, lengths=(2, 3))
    changes: list[ChangeConfig] = field(default_factory=list)
    """[m]"""
    stages: StagesConfig = field(default_factory=StagesConfig)


def load(*texts: str) -> RootConfig:
    return load_config(RootConfig, [override_layer(text) for text in texts])


def test_no_layers_give_the_defaults_in_code():
    assert load() == RootConfig()
    assert load().stages.swing.horizon == 0.5


def test_later_layers_lie_on_top():
    config = load("stages.mpc.horizon=2", "stages.mpc.knots=7", "stages.mpc.horizon=3", "goal=[1, 2.5]")
    assert config.stages.mpc == SolverConfig(horizon=3.0, knots=7)
    assert config.stages.swing == SolverConfig(horizon=0.5)
    assert config.goal == [1.0, 2.5]


def test_lists_are_replaced_as_a_whole():
    assert load("stages.mpc.weights=[5]").stages.mpc.weights == [5.0]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("stages.mpc.horizon=1e-3", 1e-3),  # text in YAML 1.1
        ("stages.mpc.horizon=3", 3.0),
        ("seed=4.0", 4),
        ("name=a=b", "a=b"),
        ("fast=true", True),
        ("goal=null", None),
    ],
)
def test_values_are_converted_without_loss(text, value):
    config = load(text)
    for name in text.split("=")[0].split("."):
        config = getattr(config, name)
    assert config == value
    assert type(config) is type(value)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("sead=1", ["--set sead=1", "'sead'", "did you mean 'seed'", "known: seed, name"]),
        ("mpc.horizon=1", ["'mpc'", "did you mean 'stages.mpc'"]),
        ("horizon=1", ["'stages.mpc.horizon' or 'stages.swing.horizon'"]),
        ("stages.mpc.knobs=1", ["unknown key 'knobs' in 'stages.mpc'", "did you mean 'knots'"]),
        ("seed=many", ["'seed' must be a whole number", "'many'"]),
        ("seed=1.5", ["'seed' must be a whole number"]),
        ("seed=true", ["'seed' must be a whole number"]),
        ("fast=1", ["'fast' must be true or false"]),
        ("name=3", ["'name' must be text"]),
        ("goal=12", ["'goal' must be a list"]),
        ("goal='12'", ["'goal' must be a list"]),
        ("goal=[1, x]", ["'goal' must be a list", "each item a number"]),
        ("stages=3", ["'stages' is a section", "mpc, swing"]),
        ("stages.mpc=null", ["'stages.mpc' is a section"]),
        ("stages.mpc.horizon.x=3", ["'stages.mpc.horizon' must be a number"]),
        ("stages.mpc.horizon=", ["'stages.mpc.horizon' must be a number"]),
        (
            "stages.mpc.horizon=nan",
            ["stages.mpc: horizon must be 0.001..1000 s, not nan"],
        ),
        ("stages.mpc.horizon=.nan", ["stages.mpc: horizon must be 0.001..1000 s, not nan"]),
        ("stages.mpc.horizon=.inf", ["stages.mpc: horizon must be 0.001..1000 s, not inf"]),
        ("stages.mpc.horizon=-1", ["stages.mpc: horizon must be 0.001..1000 s, not -1", "--set stages.mpc.horizon=-1"]),
        ("stages.mpc.knots=100", ["stages.mpc: too many knots"]),
        ("stages.mpc.knots='99999999999999999999'", ["knots must be 1..100, not a whole number beyond 64 bits"]),
        ("stages.mpc.weights=[1, -1]", ["weights[1] must be 0..100, not -1"]),
        ("stages.mpc.weights=[1,1,1,1,1,1,1,1,1,1]", ["weights must have 0..9 items, not 10"]),
        ("goal=[1]", ["goal must have 2 or 3 items, not 1"]),
        ("changes=[{time: 1}, {time: 11}]", ["changes[1]: time must be 0..10 s, not 11", "--set changes="]),
        ("changes=[{tim: 1}]", ["unknown key 'tim' in 'changes[0]'; did you mean 'time'"]),
        ("changes=[3]", ["'changes[0]' is a section"]),
        ("changes={time: 3}", ["'changes' must be a list"]),
        ("gaol=1", ["did you mean 'goal'?"]),
        ("start=1", ["unknown key 'start'; known: seed"]),
        ("seed", ["--set 'seed'", "key=value"]),
        ("=3", ["key=value"]),
        ("stages..mpc=3", ["key=value"]),
        ("seed=[1", ["not valid YAML"]),
    ],
)
def test_mistakes_are_named_in_one_line(text, parts):
    with pytest.raises(UserInputError) as caught:
        load(text)
    message = str(caught.value)
    assert "\n" not in message
    for part in parts:
        assert part in message


def test_only_the_final_values_are_checked():
    assert load("stages.mpc.horizon=-1", "stages.mpc.horizon=2").stages.mpc.horizon == 2.0


def test_saved_configuration_is_complete_and_reads_back(tmp_path):
    config = load("seed=3", "goal=[1, 2]", "stages.swing.knots=4")
    save_config(config, tmp_path / "config.yaml")
    layer = read_layer(tmp_path / "config.yaml")
    assert load_config(RootConfig, [layer]) == config
    assert layer.data["stages"]["mpc"]["horizon"] == 1.0


@pytest.mark.parametrize(
    ("content", "part"),
    [
        ("seed: 1\nseed: 2\n", "line 2: not valid YAML: the key 'seed' appears twice"),
        ("seed: [1\n", "not valid YAML"),
        ("- 1\n", "the root must be a mapping"),
        ("sead: 1\n", "unknown key 'sead'"),
        (b"\xff\xfe\x00", "not UTF-8 text"),
    ],
)
def test_a_wrong_file_is_named(tmp_path, content, part):
    path = tmp_path / "scenario.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(UserInputError, match=r"scenario\.yaml") as caught:
        load_config(RootConfig, [read_layer(path)])
    assert part in str(caught.value)


def test_a_missing_file_and_an_empty_one(tmp_path):
    with pytest.raises(UserInputError, match=r"none\.yaml: no such file"):
        read_layer(tmp_path / "none.yaml")
    (tmp_path / "empty.yaml").touch()
    assert load_config(RootConfig, [read_layer(tmp_path / "empty.yaml")]) == RootConfig()


def test_a_layer_moves_below_a_key():
    assert ConfigLayer("x", {"mpc": {"knots": 3}}).under("stages").data == {"stages": {"mpc": {"knots": 3}}}
    assert ConfigLayer("x", {}).under("stages").data == {}


def test_keys_are_listed():
    assert config_keys(RootConfig)[-1] == "stages.swing.weights"


def test_every_configuration_of_the_package_survives_saving_and_loading(tmp_path):
    for cls in configuration_classes():
        save_config(cls(), tmp_path / "config.yaml")
        assert load_config(cls, [read_layer(tmp_path / "config.yaml")]) == cls(), cls.__name__


@pytest.mark.parametrize("robot", robot_names())
def test_the_defaults_of_a_robot_fit(robot):
    from quadpips_drake.diagrams.quadpips import QuadpipsConfig

    layer = robot_defaults_layer(robot)
    config = load_config(QuadpipsConfig, [layer])
    assert (config != QuadpipsConfig()) == bool(layer.data)
