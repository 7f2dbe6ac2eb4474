"""Predictions made of predictions: errors are carried along as a search carries them."""

import dataclasses

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.fitting import EXACT_INPUTS, fit_linear
from quadpips_drake.baselines.motion_models.scores import foothold_errors, rmse_by_step
from quadpips_drake.baselines.motion_models.state import COMMAND, FEET_SHIFT, PAIRS, StepState
from quadpips_drake.baselines.motion_models.step_data import join_steps, steps_of
from tests.baselines.motion_models.synthetic import linear_walk, walk_rows

HORIZON = 4


def of_swing_0(coefficients):
    """Predicts with the coefficients of swing 0."""
    return lambda x: x @ coefficients[0].T


def steps_by(coefficients, seeds, noise: float = 0.0):
    return join_steps([steps_of(walk_rows(coefficients, seed, noise=noise), seed) for seed in seeds])


def test_the_models_of_a_walk_foresee_all_of_it():
    errors = foothold_errors(of_swing_0(linear_walk()), steps_by(linear_walk(), range(3)), HORIZON)
    assert errors.shape == (3 * (59 - HORIZON + 1), HORIZON, 2, 2)
    np.testing.assert_allclose(errors, 0.0, atol=1e-12)


@pytest.mark.parametrize("seed", [0, 1])
def test_wrong_models_err_as_if_each_step_had_begun_where_they_said(seed):
    wrong = linear_walk() + 0.01 * linear_walk(3)
    rows = walk_rows(linear_walk(), seed)
    errors = foothold_errors(of_swing_0(wrong), steps_by(linear_walk(), [seed]), HORIZON)
    state, real = _state(rows, 0), _state(rows, 0)
    for k in range(HORIZON):
        command = rows["inputs"][k][[*range(COMMAND.start, COMMAND.stop), 19]]
        turns = {name: rows["inputs"][k][i] for name, i in (("yaw_rate", 17), ("previous_yaw_rate", 18))}
        state = dataclasses.replace(state, **turns)
        legs = list(PAIRS[state.swing])
        state = state.after(command, wrong[state.swing] @ state.inputs(command))
        real = _state(rows, k + 1)
        np.testing.assert_allclose(errors[0, k], _in_B(state.feet_W - real.feet_W, real.yaw)[legs], atol=1e-12)
    assert np.abs(errors[0, -1]).max() > 1e-3 and FEET_SHIFT.stop - FEET_SHIFT.start == 4


def test_runs_do_not_reach_over_gaps_walks_or_fast_steps_aside():
    steps = steps_by(linear_walk(), [0])
    predict = of_swing_0(linear_walk())
    left_out = steps.chosen(np.arange(59) != 20)
    assert len(foothold_errors(predict, left_out, HORIZON)) == (20 - HORIZON + 1) + (38 - HORIZON + 1)
    assert len(foothold_errors(predict, steps, HORIZON, most_left=0.15)) < len(foothold_errors(predict, steps, HORIZON))
    assert not len(foothold_errors(predict, steps, 60)) and rmse_by_step(foothold_errors(predict, steps, 60)) == []


def test_errors_of_the_inputs_are_what_a_fit_has_to_bear():
    """Feet that hardly move against each other teach nothing of themselves: a fit that trusts them blows up ahead."""
    walk = linear_walk()
    train, others = (steps_by(walk, seeds, noise=0.01) for seeds in (range(2), range(20, 30)))
    train, others = (_with_stiff_feet(steps) for steps in (train, others))
    trusting, wary = fit_linear(train, (), EXACT_INPUTS), fit_linear(train)
    assert np.abs(wary).max() < 0.3 * np.abs(trusting).max()
    ahead = {
        name: rmse_by_step(foothold_errors(lambda x, fit=fit: x @ fit.T, others))
        for name, fit in (("trusting", trusting), ("wary", wary))
    }
    assert ahead["wary"][0] < 1.1 * ahead["trusting"][0] and ahead["wary"][-1] < 0.5 * ahead["trusting"][-1]


def _with_stiff_feet(steps):
    """The same steps, in whose inputs the left feet are where the right ones are, within 0.1 mm."""
    inputs, rng = steps.inputs.copy(), np.random.default_rng(5)
    for left, right in ((8, 10), (9, 11), (12, 14), (13, 15)):
        inputs[:, left] = inputs[:, right] + 1e-4 * rng.normal(size=len(inputs))
    return dataclasses.replace(steps, inputs=inputs)


def _state(rows, i: int) -> StepState:
    x = rows["inputs"][i]
    previous = x[[6, 7, 20]]
    return StepState(
        rows["position"][i], float(rows["yaw"][i]), rows["velocity"][i], x[2:4], previous, rows["feet"][i], rows["swing"][i]
    )


def _in_B(vectors: np.ndarray, yaw: float) -> np.ndarray:
    cos, sin = np.cos(yaw), np.sin(yaw)
    return vectors @ np.array([[cos, -sin], [sin, cos]])
