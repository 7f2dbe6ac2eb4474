"""Least squares find the models of a walk that is linear, and say when they cannot."""

import dataclasses

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.fitting import (
    EXACT_INPUTS,
    INPUT_ERRORS,
    LINEAR_VARIANTS,
    PLAIN,
    fit_linear,
    fit_quadratic,
    fit_variant,
    left_out_residuals,
)
from quadpips_drake.baselines.motion_models.models import models_of_both_pairs
from quadpips_drake.baselines.motion_models.scores import FORWARD, figures, residuals_of
from quadpips_drake.baselines.motion_models.state import COMMAND, FEET, INPUTS, TURN
from quadpips_drake.baselines.motion_models.step_data import join_steps, steps_of
from quadpips_drake.errors import UserInputError
from tests.baselines.motion_models.synthetic import STEP, linear_walk, walk_rows

FIELDS = ("inputs", "outputs", "swing", "walk", "duration")


def steps_by(coefficients, seeds=range(6), noise: float = 0.0):
    """Steps of several synthetic walks."""
    return join_steps([steps_of(walk_rows(coefficients, seed, noise=noise), seed) for seed in seeds])


def test_the_models_of_a_linear_walk_are_recovered_exactly():
    coefficients = linear_walk()
    steps = steps_by(coefficients)
    assert len(steps) == 6 * 59 and set(steps.swing) == {0, 1}
    np.testing.assert_allclose(steps.duration, STEP)
    np.testing.assert_allclose(models_of_both_pairs(fit_linear(steps, (), EXACT_INPUTS)), coefficients, atol=1e-8)


def test_each_pair_of_feet_teaches_the_other():
    coefficients, steps = linear_walk(), steps_by(linear_walk())
    for swing in (0, 1):
        fitted = fit_linear(steps.chosen(steps.swing == swing), (), EXACT_INPUTS)
        np.testing.assert_allclose(models_of_both_pairs(fitted), coefficients, atol=1e-8)


def test_inputs_that_are_left_out_have_no_effect_and_are_missed():
    steps, others = steps_by(linear_walk(), noise=1e-3), steps_by(linear_walk(), range(20, 24), noise=1e-3)
    rmse = {}
    for name, without in LINEAR_VARIANTS.items():
        fitted = fit_variant(steps, name)
        for inputs in without:
            assert not fitted[:, inputs].any()
        rmse[name] = figures(residuals_of(lambda x, fitted=fitted: x @ fitted.T, others), FORWARD)
    assert rmse["full"]["fdm"]["rmse"] == pytest.approx(1e-3, rel=0.15)
    for name in ("no history", "no feet"):
        assert rmse[name]["fdm"]["rmse"] > 1.5 * rmse["full"]["fdm"]["rmse"]


def test_inputs_that_are_off_count_less():
    """The least of the expected squared error: the same as of very many steps whose inputs are off by chance."""
    steps, rng = steps_by(linear_walk(), noise=1e-3), np.random.default_rng(3)
    errors = 5.0 * INPUT_ERRORS
    many = dataclasses.replace(steps, **{name: np.concatenate(300 * [getattr(steps, name)]) for name in FIELDS})
    off = dataclasses.replace(many, inputs=many.inputs + errors * rng.normal(size=many.inputs.shape))
    expected, fitted = fit_linear(off, (), EXACT_INPUTS), fit_linear(steps, (), errors)
    np.testing.assert_allclose(fitted, expected, atol=0.01)
    assert np.abs(fitted - fit_variant(steps, PLAIN)).max() > 0.1


def test_the_second_degree_brings_nothing_to_a_linear_walk():
    steps, others = steps_by(linear_walk(), noise=1e-2), steps_by(linear_walk(), range(20, 24), noise=1e-2)
    full = fit_linear(steps)
    linear = figures(residuals_of(lambda x: x @ full.T, others), FORWARD)
    quadratic = figures(residuals_of(fit_quadratic(steps).predict_first, others), FORWARD)
    assert quadratic["cdm"]["rmse"] > linear["cdm"]["rmse"]


def test_errors_of_walks_that_were_left_out_are_as_large_as_the_noise():
    residuals = left_out_residuals(steps_by(linear_walk(), noise=0.01))
    np.testing.assert_allclose(residuals.std(axis=0), 0.01, rtol=0.2)


def test_what_cannot_be_learned_is_refused_by_name():
    steps = steps_by(linear_walk())
    with pytest.raises(UserInputError, match="30 steps are too few"):
        fit_linear(steps.chosen(np.arange(30)))
    for column, words in ((COMMAND.start + 1, "never varied: left command;"), (TURN.start, "never varied: yaw rate;")):
        inputs = steps.inputs.copy()
        inputs[:, column] = 0.0
        with pytest.raises(UserInputError, match=words):
            fit_linear(type(steps)(inputs, steps.outputs, steps.swing, steps.walk, steps.duration))
    inputs = steps.inputs.copy()
    inputs[:, FEET.start] = inputs[:, FEET.start + 2] = inputs[:, COMMAND.start]
    with pytest.raises(UserInputError, match=r"varied only together: .*x of foot LF"):
        fit_linear(type(steps)(inputs, steps.outputs, steps.swing, steps.walk, steps.duration))
    inputs = steps.inputs.copy()
    inputs[3, 4] = np.nan
    with pytest.raises(UserInputError, match="NaN"):
        fit_linear(type(steps)(inputs, steps.outputs, steps.swing, steps.walk, steps.duration))
    assert steps.inputs.shape[1] == INPUTS
