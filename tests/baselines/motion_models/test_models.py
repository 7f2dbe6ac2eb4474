"""Linear models as numbers, and as files that may be anything."""

import json

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.model_file import (
    CARD,
    WEIGHTS,
    check_walk,
    load_models,
    read_models,
    save_models,
)
from quadpips_drake.baselines.motion_models.models import MotionModels, ideal_coefficients, models_of_both_pairs
from quadpips_drake.baselines.motion_models.state import (
    COMMAND,
    INPUTS,
    NEXT_VELOCITY,
    OUTPUTS,
    mirrored_inputs,
    mirrored_outputs,
)
from quadpips_drake.baselines.motion_models.walk_settings import motion_models_walk, walk_settings
from quadpips_drake.control.mpc.mpc_config import walking_mpc
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig
from quadpips_drake.diagrams.tracking_module import TrackingConfig
from quadpips_drake.errors import UserInputError


def some_models(seed: int = 0, **changes) -> MotionModels:
    """Models with random numbers."""
    rng = np.random.default_rng(seed)
    settings = walk_settings(motion_models_walk(), TrackingConfig(mpc=walking_mpc()))
    values = {"coefficients": models_of_both_pairs(rng.normal(size=(OUTPUTS, INPUTS)))}
    values |= {"covariance": np.tile(np.eye(OUTPUTS), (2, 1, 1)), "settings": settings, "top_speed": 1.0}
    return MotionModels(**{"robot": "anymal_c", "gait": "trot", "step_duration": 0.3} | values | changes)


def test_what_one_pair_does_the_other_does_in_a_mirror():
    models, x = some_models(), np.random.default_rng(1).normal(size=(7, INPUTS))
    np.testing.assert_allclose(models.predict(mirrored_inputs(x), 1), mirrored_outputs(models.predict(x, 0)), atol=1e-12)
    swings = np.arange(7) % 2
    each = [models.predict(row, swing) for row, swing in zip(x, swings, strict=True)]
    np.testing.assert_allclose(models.predict(x, swings), each, atol=1e-12)


def test_the_three_models_are_parts_of_one_prediction():
    models, x = some_models(), np.random.default_rng(2).normal(size=INPUTS)
    parts = [models.cdm[1] @ x, *(models.fdm[1] @ x), models.cvm[1] @ x]
    np.testing.assert_allclose(np.concatenate(parts), models.predict(x, 1))


def test_the_ideal_walk_follows_a_command_at_once():
    x = np.zeros(INPUTS)
    x[COMMAND] = 0.4, -0.1
    for coefficients in ideal_coefficients(0.3):
        y = coefficients @ x
        np.testing.assert_allclose(y, [0.12, -0.03, 0.24, -0.06, 0.24, -0.06, 0.4, -0.1])
        np.testing.assert_allclose(y[NEXT_VELOCITY], x[COMMAND])


def test_models_come_back_from_their_files_as_they_were(tmp_path):
    models = some_models()
    save_models(tmp_path, models, {"data": {"seeds": [1]}})
    back, card = read_models(tmp_path)
    np.testing.assert_array_equal(back.coefficients, models.coefficients)
    np.testing.assert_array_equal(back.covariance, models.covariance)
    assert (back.robot, back.gait, back.step_duration, back.top_speed) == ("anymal_c", "trot", 0.3, 1.0)
    assert back.settings == models.settings
    assert back.coefficients.flags.c_contiguous and card["data"] == {"seeds": [1]}
    assert load_models("anymal_c", "trot", tmp_path).robot == "anymal_c"


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda d: (d / WEIGHTS).unlink(), "no such file"),
        (lambda d: (d / CARD).unlink(), "no such file"),
        (lambda d: (d / WEIGHTS).write_bytes(b"PK" + bytes(100)), "SHA-256"),
        (lambda d: (d / WEIGHTS).write_bytes(bytes(2_000_000)), "larger than"),
        (lambda d: (d / CARD).write_text("{"), "not valid JSON"),
        (lambda d: (d / CARD).write_text("[]"), "no card"),
        (lambda d: change_card(d, step_duration=float("nan")), "step_duration"),
        (lambda d: change_card(d, robot=3), "robot"),
        (lambda d: change_card(d, version=99), "version"),
        (lambda d: save_models(d, some_models(coefficients=np.full((2, OUTPUTS, INPUTS), np.nan))), "not finite"),
        (lambda d: save_models(d, some_models(coefficients=np.zeros((2, OUTPUTS, 3)))), "must be float64"),
        (lambda d: save_models(d, some_models(covariance=np.zeros((200, 200)))), "too large"),
    ],
)
def test_unsound_files_are_refused_in_one_line(tmp_path, spoil, words):
    save_models(tmp_path, some_models())
    spoil(tmp_path)
    with pytest.raises(UserInputError, match=words) as refusal:
        read_models(tmp_path)
    assert "\n" not in str(refusal.value) and "quadpips motion-models train" in str(refusal.value)


def change_card(directory, **changes) -> None:
    """Changes entries of the card, and nothing else."""
    card = json.loads((directory / CARD).read_text())
    (directory / CARD).write_text(json.dumps(card | changes))


def test_arrays_that_are_pickled_objects_are_not_executed(tmp_path):
    save_models(tmp_path, some_models(coefficients=np.array([print], dtype=object)))
    with pytest.raises(UserInputError, match="damaged"):
        read_models(tmp_path)


def test_models_of_another_robot_gait_or_walk_are_refused(tmp_path):
    save_models(tmp_path, some_models())
    for robot, gait, word in (("go2", "trot", "robot"), ("anymal_c", "pace", "gait")):
        with pytest.raises(UserInputError, match=f"of the {word}"):
            load_models(robot, gait, tmp_path)
    with pytest.raises(UserInputError, match="no motion models of anymal_c in amble"):
        load_models("anymal_c", "amble")
    tracking = TrackingConfig(mpc=walking_mpc())
    check_walk(some_models(), motion_models_walk(), tracking)
    with pytest.raises(UserInputError, match=r"max_acceleration is 0\.5, and was 4\.0"):
        check_walk(some_models(), VelocityReferenceConfig(), tracking)


def test_a_setting_that_is_newer_than_the_model_must_have_its_default():
    models, tracking = some_models(), TrackingConfig(mpc=walking_mpc())
    older = {key: value for key, value in models.settings.items() if not key.endswith(".leash")}
    walk = motion_models_walk()
    check_walk(some_models(settings=older), walk, tracking)
    walk.leash = 0.3
    with pytest.raises(UserInputError, match="leash"):
        check_walk(some_models(settings=older), walk, tracking)
