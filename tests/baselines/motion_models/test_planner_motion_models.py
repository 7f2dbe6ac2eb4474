"""The planner ``motion_models`` in the whole diagram: it walks, tells, repeats to the bit, and refuses what it cannot do."""

from dataclasses import replace

import numpy as np
import pytest

import quadpips_drake as qp
from quadpips_drake.baselines.motion_models.model_file import CARD, WEIGHTS, save_models
from quadpips_drake.baselines.motion_models.models import MotionModels
from quadpips_drake.baselines.motion_models.planner.variants import kinematic_coefficients
from quadpips_drake.baselines.motion_models.state import OUTPUTS
from quadpips_drake.baselines.motion_models.walk_settings import walk_settings
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trials.trial import Trial, TrialConfig
from quadpips_drake.trials.trial_options import resolve_config
from tests.cli.test_run import quadpips
from tests.compare_logs import differences

SECTION = "stages.motion_models"


def config(*sets, **options) -> TrialConfig:
    options = {"robot": "anymal_c", "terrain": "flat", "planner": "motion_models", **options}
    return resolve_config(TrialConfig, None, options, ["stages.region_source=oracle", *sets])


@pytest.fixture
def models(tmp_path):
    """Files of models of the present walk, as learned ones are."""
    stages = config(f"{SECTION}.variant=ideal").stages
    settings = walk_settings(stages.motion_models.velocity_reference, stages.tracking)
    coefficients = kinematic_coefficients(load_robot("anymal_c"), load_gait("trot"))
    found = MotionModels("anymal_c", "trot", 0.3, coefficients, np.zeros((2, OUTPUTS, OUTPUTS)), settings, 1.0)
    save_models(tmp_path, found)
    return tmp_path


def run(*sets, duration: float, **options) -> Trial:
    trial = Trial(config(*sets, duration=duration, **options))
    trial.run()
    return trial


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["anymal_c", "go2"])
def test_it_walks_towards_the_goal(robot):
    trial = run(f"{SECTION}.variant=kinematic", robot=robot, duration=3.0, seed=2)
    result = trial.result()
    assert result.reason == "timeout" and result.planner == "motion_models"
    assert trial.log.arrays()["p_WB"][-1, 0] - trial.start[0] > 0.4
    assert result.planning["plans"] == result.replans + 1 >= 8
    assert result.planning["errors"]["steps"] == result.planning["plans"] - 1
    assert 0.0 < result.planning["errors"]["cdm"]["mae"] < 0.05
    assert result.footholds["touch_downs"] >= 14 and result.footholds["unsafe"] == 0
    assert result.fallbacks["mpc"] == result.fallbacks["wbc"] == 0


@pytest.mark.slow
def test_it_crosses_a_gap_with_what_was_learned():
    trial = run(terrain="gaps_symmetric", start=[-0.75, 0.0, 0.0], goal=[0.6, 0.0], duration=12.0, seed=5)
    result = trial.result()
    assert result.reason == "goal_reached"
    assert result.footholds["unsafe"] == 0 and result.footholds["deepest_m"] <= 0.05
    feet = trial.log.arrays()["foot_positions"]
    assert (feet[-1, :, 0] > 0.1).all(), "all feet are over it"
    errors = result.planning["errors"]
    assert errors["cdm"]["mae"] < 0.02 and errors["fdm"]["mae"] < 0.03 and errors["cvm"]["mae"] < 0.1


@pytest.mark.slow
def test_same_seed_same_log_to_the_bit():
    def log():
        return run(f"{SECTION}.variant=kinematic", duration=1.2, seed=3).log.arrays()

    assert not differences(log(), log())


@pytest.mark.slow
def test_a_camera_that_sees_nothing_is_no_reason_to_walk_blindly():
    nothing_assumed = [f"stages.perception.egocan.ground.assumed_{where}=0" for where in ("behind", "ahead", "half_width")]
    blind = ["stages.perception.depth_noise.dropout=1.0", "stages.region_source=superpixels"]
    trial = run(f"{SECTION}.variant=ideal", *blind, *nothing_assumed, duration=30.0)
    result = trial.result()
    assert result.reason == "no_plan" and "map" in result.detail
    assert result.sim_time < 3.0 and result.footholds["touch_downs"] == 0


@pytest.mark.slow
def test_a_recording_shows_costmap_plan_and_real_footholds(tmp_path):
    wanted = config(f"{SECTION}.variant=kinematic", duration=1.2)
    result = qp.run_trial(wanted, tmp_path, recording=True, report=False)
    assert result.reason == "timeout"
    page = (tmp_path / "recording.html").read_text()
    for layer in ("costmap", "landed", "stances"):
        assert f'"{layer}"' in page or f"/quadpips/{layer}" in page, layer
    assert qp.load_config(file=tmp_path / "config.yaml").stages.motion_models.variant == "kinematic"


def test_models_of_this_walk_are_taken(models):
    trial = Trial(config(f"{SECTION}.models={models}"))
    assert trial.diagram.planning.GetOutputPort("velocity_plan")


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        (["variant=perfect"], "variant of motion models 'perfect'; known: blind"),
        (["gait=static_walk"], "diagonal pairs must swing in turn"),
        (["planner.search.horizon=0"], "horizon must be 1..20"),
        (["planner.search.horizon=21"], "horizon must be 1..20"),
        (["models=nowhere"], "motion models nowhere"),
        (
            ["models={models}", "velocity_reference.max_acceleration=0.5"],
            "of another walk: velocity_reference.max_acceleration",
        ),
        (["models={models}", "gait=slow_trot"], "of the gait trot, not slow_trot"),
    ],
)
def test_bad_input_ends_with_one_line_and_status_2(sets, words, models, tmp_path):
    texts = [f"{SECTION}.{text.format(models=models)}" for text in sets]
    arguments = [word for text in texts for word in ("--set", text)]
    status, _, errors = quadpips(
        "run", "--planner", "motion_models", "--terrain", "flat", "--regions", "oracle", "--no-recording", *arguments,
        "--out", tmp_path / "out",
    )  # fmt: skip
    lines = [line for line in errors.splitlines() if line.strip() and not line.startswith("building")]
    assert status == 2 and len(lines) == 1, errors
    assert words in lines[0]


@pytest.mark.parametrize("damage", ["cut", "other robot", "other walk", "no card"])
def test_damaged_models_are_refused(damage, models):
    if damage == "cut":
        (models / WEIGHTS).write_bytes((models / WEIGHTS).read_bytes()[:200])
    elif damage == "no card":
        (models / CARD).unlink()
    options, more = {}, []
    if damage == "other robot":
        options["robot"] = "go2"
    if damage == "other walk":
        more = ["stages.tracking.mpc.ocp.weights.base_orientation=[100,300,300]"]
    with pytest.raises(qp.UserInputError) as caught:
        Trial(config(f"{SECTION}.models={models}", *more, **options))
    assert "\n" not in str(caught.value)
    assert {"cut": "SHA-256", "no card": CARD, "other robot": "anymal_c", "other walk": "base_orientation"}[damage] in str(
        caught.value
    )


def test_a_goal_off_the_map_is_refused():
    with pytest.raises(qp.UserInputError, match="goal"):
        Trial(config(f"{SECTION}.variant=blind", goal=[500.0, 0.0]))


def test_the_map_is_exact_where_regions_are():
    exact, seen = Trial(config(f"{SECTION}.variant=ideal")), config(f"{SECTION}.variant=ideal")
    assert not exact.diagram.planning.HasInputPort("ground_heights")
    seen = replace(seen, stages=replace(seen.stages, region_source="superpixels"))
    assert Trial(seen).diagram.planning.HasInputPort("ground_heights")
