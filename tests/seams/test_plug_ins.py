"""What lives in a package of somebody else is found by its name, configured, wired, run and judged like our own."""

import json
from dataclasses import dataclass

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

import quadpips_drake as qp
from quadpips_drake.cli.main import app
from tests.seams.conftest import NAMES

EVERYTHING = ["--planner", "straight", "--regions", "carpet", "--robot", "long_dog", "--terrain", "two_slabs"]
CLOCK = ["--set", "stages.state_estimator=stuck_clock"]


def run(*arguments, out):
    """Runs ``quadpips run``; returns exit status, result and what was printed."""
    done = CliRunner().invoke(app, ["run", "--no-recording", *arguments, "--out", str(out)], prog_name="quadpips")
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    result = json.loads((out / "result.json").read_text()) if (out / "result.json").exists() else None
    return done.exit_code, result, done.output


def test_names_are_listed(scratch_package):
    for registry, name in NAMES.items():
        assert name in getattr(qp.registries, registry).names()


@pytest.mark.slow
def test_everything_from_outside_reaches_the_goal(scratch_package, tmp_path):
    more = ["--goal", "0.8,0.2", "--set", "stages.straight.tolerance=0.1", "--duration", "12"]
    status, result, printed = run(*EVERYTHING, *CLOCK, *more, out=tmp_path)
    assert status == 0, printed
    assert (result["reason"], result["robot"], result["terrain"]) == ("goal_reached", "long_dog", "two_slabs")
    assert result["planner"] == "straight" and result["fallbacks"]["thoughts"] == 0
    config = yaml.safe_load((tmp_path / "config.yaml").read_text())
    assert config["stages"]["straight"]["tolerance"] == 0.1 and config["stages"]["carpet"]["squares"] == 11
    # A robot's own numbers come from the file beside its robot.yaml.
    assert config["stages"]["planning"]["torso"]["node_spacing"] == 0.15


def test_a_planner_that_gives_up_ends_the_trial(scratch_package, tmp_path):
    status, result, _ = run(*EVERYTHING, "--set", "stages.straight.patience=0.1", out=tmp_path)
    assert status == 1 and result["reason"] == "no_plan" and result["detail"] == "out of patience"


def test_a_saved_configuration_repeats_the_trial(scratch_package, tmp_path):
    run(*EVERYTHING, *CLOCK, "--duration", "0.2", out=tmp_path / "first")
    status, _, printed = run(str(tmp_path / "first" / "config.yaml"), out=tmp_path / "second")
    assert status == 1, printed
    first, second = (np.load(tmp_path / name / "log.npz") for name in ("first", "second"))
    for name in first.files:
        np.testing.assert_array_equal(first[name], second[name])


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["--set", "stages.straight.sped=1"], ["sped", "speed"]),
        (["--set", "stages.straight.speed=fast"], ["speed", "number"]),
        (["--set", "stages.carpet.rate=0"], ["rate"]),
    ],
    ids=["unknown key", "wrong type", "out of range"],
)
def test_their_settings_are_checked_like_ours(scratch_package, tmp_path, arguments, parts):
    status, _, printed = run(*EVERYTHING, *arguments, out=tmp_path)
    assert status == 2 and all(part in printed for part in parts), printed


def test_their_planner_steps_on_our_regions(scratch_package):
    """A region source of one's own feeds QuadPiPS' own planner."""
    config = qp.load_config(terrain="flat", sets=["stages.region_source=carpet"])
    diagram = qp.QuadpipsDiagram(qp.load_robot("anymal_c"), qp.load_terrain("flat"), config.stages)
    context = diagram.CreateDefaultContext()
    diagram.set_initial_state(context, [0.0, 0.0, 0.0])
    assert diagram.planning.get_name() == "planning" and diagram.regions.get_name() == "carpet"
    assert diagram.GetOutputPort("region_set").Eval(context).regions == ()  # before the first tick


class WithoutStatus(qp.Stage):
    """A planner that forgets to say how it is doing."""

    def __init__(self, setup):
        super().__init__("without_status", qp.StageConfig(), memory=None)
        self.declare_output("reference", qp.WholeBodyReference, lambda _: qp.WholeBodyReference.empty())


class WrongReference(qp.Stage):
    """A planner whose reference is none."""

    def __init__(self, setup):
        super().__init__("wrong_reference", qp.StageConfig(), memory=None)
        self.declare_output("reference", qp.RobotState, lambda _: qp.RobotState.empty())


class StrangeInput(qp.Stage):
    """A planner that wants what nobody has."""

    def __init__(self, setup):
        super().__init__("strange_input", qp.StageConfig(), memory=None)
        self.declare_input("crystal_ball", qp.RegionSet)


@pytest.mark.parametrize(
    ("planner", "message"),
    [
        (WithoutStatus, "without_status has no output port 'status'"),
        (WrongReference, "wrong_reference.reference must carry WholeBodyReference, not RobotState"),
        (StrangeInput, "nothing feeds the input strange_input.crystal_ball"),
    ],
)
def test_a_planner_that_breaks_the_contract_is_refused_when_the_diagram_is_built(planner, message):
    qp.registries.planners.add("broken", planner)
    try:
        with pytest.raises(TypeError, match=message):
            qp.QuadpipsDiagram(qp.load_robot("go2"), qp.load_terrain("flat"), planner="broken")
    finally:
        qp.registries.planners.remove("broken")


@dataclass
class ThiefConfig(qp.StageConfig):
    """Settings in a section that is another's."""


def test_a_section_has_one_owner():
    qp.registries.planners.add("thief", WithoutStatus, ThiefConfig, section="tracking")
    try:
        with pytest.raises(qp.UserInputError, match="'thief' cannot have 'tracking' as its section"):
            qp.TrialConfig(planner="thief")
    finally:
        qp.registries.planners.remove("thief")
