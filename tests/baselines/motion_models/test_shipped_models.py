"""The models that come with the package."""

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.fitting import LINEAR_VARIANTS
from quadpips_drake.baselines.motion_models.model_file import (
    check_walk,
    load_models,
    model_directory,
    read_models,
    shipped_models,
)
from quadpips_drake.baselines.motion_models.state import FEET_SHIFT, StepState
from quadpips_drake.baselines.motion_models.variants import FULL, read_variants
from quadpips_drake.baselines.motion_models.walk_settings import motion_models_walk
from quadpips_drake.diagrams.walk import WalkConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trials.trial_options import default_stages

BOTH = [(robot, gait) for robot in ("anymal_c", "go2") for gait in ("standing_trot", "trot")]


def test_both_robots_have_models_and_they_are_small():
    assert shipped_models() == BOTH
    folders = {model_directory(*pair) for pair in BOTH}
    assert sum(path.stat().st_size for folder in folders for path in folder.iterdir()) < 100_000


@pytest.mark.parametrize(("robot", "gait"), BOTH)
def test_they_are_of_the_walk_as_it_is(robot, gait):
    """If this fails the walk has changed: collect, train and test anew, see docs/motion_models.md."""
    stages = default_stages(WalkConfig, robot)
    check_walk(load_models(robot, gait), motion_models_walk(), stages.tracking)


@pytest.mark.parametrize(("robot", "gait"), BOTH)
def test_they_go_forward_when_told_to(robot, gait):
    """Out of standing, and soon as fast as they are told."""
    models, command, still = load_models(robot, gait), np.array([0.3, 0.0, 0.0]), np.zeros(2)
    feet = load_robot(robot).nominal_footholds_B[:, :2].copy()
    state = StepState(still, 0.0, still, still, np.zeros(3), feet, swing=0)
    for _ in range(6):
        outputs = models.predict(state.inputs(command), state.swing)
        before, state = state, state.after(command, outputs)
        assert (outputs[FEET_SHIFT][::2] > 0.0).all()
    step = command[0] * models.step_duration
    assert state.position[0] - before.position[0] == pytest.approx(step, rel=0.2)
    assert outputs[FEET_SHIFT][::2] == pytest.approx(2.0 * step, rel=0.2)
    assert np.linalg.eigvalsh(models.covariance).min() > 0.0


@pytest.mark.parametrize(("robot", "gait"), BOTH)
def test_their_cards_tell_where_they_come_from_and_how_good_they_are(robot, gait):
    directory = model_directory(robot, gait)
    _, card = read_models(directory)
    assert card["data"]["seeds"] and sum(card["data"]["steps"].values()) >= 100
    assert set(card["other_walks"]["x"]) == {"cdm", "fdm", "cvm"}
    variants = read_variants(directory)
    assert set(variants.linear) == set(LINEAR_VARIANTS)
    np.testing.assert_allclose(variants.linear[FULL], load_models(robot, gait).coefficients[0], rtol=1e-5, atol=1e-6)
