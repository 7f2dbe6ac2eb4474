"""``import quadpips_drake``: what it offers, and that a robot's own numbers come with its name."""

import inspect
import subprocess
import sys

import pytest
import yaml
from pydrake.common.yaml import yaml_dump_typed

import quadpips_drake as qp


def test_every_public_name_is_there_documented_and_in_the_overview():
    for name in qp.__all__:
        value = getattr(qp, name)
        assert name in qp.__doc__ or name == "__version__", f"{name} is missing in the overview"
        if name != "__version__":
            assert inspect.getdoc(value), name
    assert set(qp.__all__) <= set(dir(qp))
    with pytest.raises(AttributeError, match="no attribute 'magic'"):
        qp.magic  # noqa: B018


def test_the_import_is_quick():
    code = "import sys, quadpips_drake; print('pydrake' in sys.modules, 'numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.split() == ["False"] * 2


@pytest.mark.parametrize("kind", [qp.TrialConfig, qp.WalkTrialConfig])
def test_a_robots_own_numbers_come_with_its_name(kind):
    load = qp.load_config if kind is qp.TrialConfig else qp.load_walk_config
    for robot in ("anymal_c", "go2"):
        assert yaml.safe_load(yaml_dump_typed(kind(robot=robot))) == yaml.safe_load(yaml_dump_typed(load(robot=robot)))


def test_the_two_robots_differ():
    assert qp.TrialConfig(robot="go2").stages.planning.torso.node_spacing == 0.15
    assert qp.TrialConfig().stages.planning.torso.node_spacing == 0.20


def test_a_configuration_for_a_robot_that_was_loaded():
    config = qp.load_config(robot=qp.load_robot("go2"), terrain="flat", sets=["stages.planning.torso.node_spacing=0.3"])
    assert (config.robot, config.terrain, config.stages.planning.torso.node_spacing) == ("go2", "flat", 0.3)


def test_a_trial_of_objects():
    terrain = qp.load_terrain("flat")
    config = qp.load_config(robot="go2", goal=[1.0, 0.5])
    trial = qp.Trial(config, robot=qp.load_robot("go2"), terrain=terrain)
    assert trial.terrain.name == "flat" and list(trial.terrain.goal) == [1.0, 0.5]
    with pytest.raises(qp.UserInputError, match=r"for the robot 'go2', not 'anymal_c': make it with load_config"):
        qp.Trial(config, robot=qp.load_robot("anymal_c"), terrain=terrain)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"robot": "spot"}, "unknown robot 'spot'"),
        ({"planner": "magic"}, "unknown planner 'magic'"),
        ({"sets": ["stages.region_source=magic"]}, "unknown region source 'magic'"),
        ({"sets": ["stages.state_estimator=magic"]}, "unknown state estimator 'magic'"),
        ({"sets": ["stages.drift.yaw_rate=0.01"]}, "state_estimator=drifting"),
        ({"robot": "no/robot.yaml"}, "no such file"),
        ({"sead": 3}, "unknown key 'sead'"),
    ],
)
def test_what_cannot_be_had_is_said_in_one_line(options, message):
    with pytest.raises(qp.UserInputError, match=message):
        qp.load_config(**options)
