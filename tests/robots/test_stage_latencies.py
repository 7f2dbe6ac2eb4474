"""Presets of latencies: complete, laid in at their place among the layers, scaled."""

from dataclasses import asdict, is_dataclass

import pytest
import yaml

import quadpips_drake as qp
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import robot_file, robot_names
from quadpips_drake.robots.stage_latencies import MEASURED, MEASURED_FILE, PRESETS, latency_layer
from quadpips_drake.trials.loading import load_walk_config

PLANNERS = ("quadpips", "s_mpc", "motion_models")
"""One of each kind: together they have all stages that a preset may delay."""


def leaves(tree: dict, path: tuple = ()) -> dict:
    """All values by their path of keys."""
    found = {}
    for key, value in tree.items():
        found |= leaves(value, (*path, key)) if isinstance(value, dict) else {(*path, key): value}
    return found


def at(config, path: tuple):
    for name in path:
        config = getattr(config, name)
    return config


def test_every_preset_sets_the_same_keys():
    """Or one of them would not replace another completely."""
    for robot in robot_names():
        keys = {name: leaves(latency_layer(name, robot).data).keys() for name in PRESETS}
        assert len(set(map(frozenset, keys.values()))) == 1, keys


@pytest.mark.parametrize("robot", ["anymal_c", "go2"])
@pytest.mark.parametrize("preset", PRESETS)
def test_a_preset_reaches_the_stages(preset, robot):
    reached = set()
    for planner in PLANNERS:
        config = qp.load_config(robot=robot, terrain="flat", planner=planner, latency=preset)
        assert config.latency == preset
        there = {path: v for path, v in leaves(latency_layer(preset, robot).data).items() if hasattr(config.stages, path[0])}
        for path, value in there.items():
            assert at(config.stages, path) == value, path
        reached |= there.keys()
        assert asdict(qp.TrialConfig(robot=robot, planner=planner, latency=preset).stages) == asdict(config.stages)
    assert reached == leaves(latency_layer(preset, robot).data).keys()


def test_zero_leaves_all_stages_as_they_are_in_code():
    from quadpips_drake.diagrams.quadpips import stages_type

    configs = [stages_type(planner, "superpixels", "oracle")() for planner in PLANNERS]
    for path, value in leaves(latency_layer("zero", "anymal_c").data).items():
        found = [at(config, path) for config in configs if hasattr(config, path[0])]
        assert found and set(found) == {value}, path


def test_measured_latencies_are_those_of_the_robot():
    for robot in ("anymal_c", "go2"):
        own = yaml.safe_load((robot_file(robot).parent / MEASURED_FILE).read_text())
        assert latency_layer(MEASURED, robot).data == own
        assert all(value > 0.0 for value in leaves(own).values())


def test_a_robot_without_measurements_computes_as_long_as_the_default_one(tmp_path):
    (tmp_path / "robot.yaml").write_text("name: new\n")
    assert latency_layer(MEASURED, str(tmp_path / "robot.yaml")).data == latency_layer(MEASURED, "anymal_c").data


def test_the_scale_is_for_latencies_alone():
    once, twice = (leaves(latency_layer("paper", "go2", scale).data) for scale in (1.0, 2.0))
    for path in once:
        assert twice[path] == pytest.approx(once[path] * (2.0 if path[-1] == "latency" else 1.0))
    assert qp.load_config(latency="paper", latency_scale=2.0).stages.tracking.mpc.latency == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("sets", "expected"),
    [
        (["stages.tracking.mpc.latency=0.007"], 0.007),
        (["latency=paper", "stages.tracking.mpc.latency=0.007"], 0.007),
        (["stages.tracking.mpc.latency=0.007", "latency=paper"], 0.02),
        (["latency=paper", "latency=zero"], 0.0),
        (["latency=paper", "latency_scale=0.5"], 0.01),
    ],
)
def test_the_later_layer_counts(sets, expected):
    assert qp.load_config(sets=tuple(sets)).stages.tracking.mpc.latency == pytest.approx(expected)


def test_a_saved_configuration_can_be_run_with_another_preset(tmp_path):
    from quadpips_drake.configuration.loading import save_config

    path = tmp_path / "config.yaml"
    save_config(qp.load_config(latency="paper", sets=("stages.planning.swings.latency=0.9",)), path)
    again = qp.load_config(file=path)
    assert (again.latency, again.stages.planning.swings.latency, again.stages.tracking.mpc.latency) == ("paper", 0.9, 0.02)
    other = qp.load_config(file=path, latency="zero")
    assert other.stages == qp.load_config(latency="zero").stages


def test_a_walk_takes_what_it_has_stages_for():
    config = load_walk_config(latency="paper")
    assert config.stages.tracking.mpc.latency == 0.02 and is_dataclass(config.stages)


def test_a_file_is_a_preset(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("planning: {swings: {latency: 0.4}}\n")
    assert qp.load_config(latency=str(path)).stages.planning.swings.latency == 0.4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"latency": "papr"}, "unknown latency 'papr'.*paper"),
        ({"latency": "none.yaml"}, "there is no such file"),
        ({"latency": 3}, "'latency' must be text"),
        ({"latency_scale": -1.0}, "latency_scale must be 0..100"),
        ({"latency": "paper", "latency_scale": 100.0}, "latency must be 0..10.*'paper' times 100"),
    ],
)
def test_bad_presets_are_refused_in_one_line(options, message):
    with pytest.raises(UserInputError, match=message):
        qp.load_config(**options)


def test_a_damaged_preset_is_refused(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("planning: {swings: {latencie: 0.4}}\n")
    with pytest.raises(UserInputError, match="latencie"):
        qp.load_config(latency=str(path))
