"""Recursive least squares: it finds a walk that has changed, and stays with one that has not."""

from dataclasses import replace

import numpy as np

from quadpips_drake.baselines.motion_models.planner.adaptation import Adaptation, AdaptationConfig
from quadpips_drake.baselines.motion_models.state import BASE_SHIFT, FEET, INPUTS, NEXT_VELOCITY
from tests.baselines.motion_models.planner.worlds import FEET_B, sluggish


def random_inputs(rng) -> np.ndarray:
    x = np.concatenate((rng.uniform(-0.1, 0.6, 8), np.zeros(8), [1.0], rng.uniform(-0.2, 0.2, 4)))
    x[FEET] = (FEET_B + rng.uniform(-0.1, 0.1, (4, 2))).ravel()
    return x


def changed(models):
    """A walk that covers 10 % less and is 5 cm/s slower."""
    coefficients = np.array(models.coefficients)
    coefficients[:, BASE_SHIFT] *= 0.9
    coefficients[:, NEXT_VELOCITY.start, 16] -= 0.05
    return replace(models, coefficients=coefficients)


def error_of(models, walk, rng) -> float:
    inputs = [(random_inputs(rng), int(rng.integers(2))) for _ in range(50)]
    return float(np.mean([np.abs(models.predict(x, swing) - walk.predict(x, swing)) for x, swing in inputs]))


def test_a_changed_walk_is_found():
    rng, walk, config = np.random.default_rng(0), changed(sluggish()), AdaptationConfig(doubt=1.0)
    now = Adaptation.begin(sluggish(), config)
    before = error_of(now.models, walk, rng)
    for _ in range(60):
        x, swing = random_inputs(rng), int(rng.integers(2))
        now = now.after(x, walk.predict(x, swing), swing, config)
    assert now.steps == 60
    assert error_of(now.models, walk, rng) < 0.1 * before
    assert np.isfinite(now.doubt).all() and (np.linalg.eigvalsh(now.doubt) > -1e-9).all()


def test_what_is_right_stays_as_it_is_and_doubt_is_bounded():
    rng, walk, config = np.random.default_rng(1), sluggish(), AdaptationConfig(forgetting=0.9)
    now = Adaptation.begin(walk, config)
    first = now.doubt
    x = random_inputs(rng)
    for _ in range(300):  # always the same step: nothing else is learned
        now = now.after(x, walk.predict(x, 0), 0, config)
    np.testing.assert_allclose(now.models.coefficients, walk.coefficients, atol=1e-9)
    assert now.doubt.shape == (INPUTS, INPUTS) and np.abs(now.doubt).max() < 30.0 * np.abs(first).max()


def test_a_step_of_either_pair_counts_for_both():
    rng, walk, config = np.random.default_rng(2), changed(sluggish()), AdaptationConfig(doubt=1.0)
    now = Adaptation.begin(sluggish(), config)
    for _ in range(60):
        x = random_inputs(rng)
        now = now.after(x, walk.predict(x, 1), 1, config)
    x = random_inputs(rng)
    np.testing.assert_allclose(now.models.predict(x, 0), walk.predict(x, 0), atol=0.01)
