"""Safety margins out of the models' errors: against many simulated walks with such errors."""

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.planner.margins import clearances, foothold_deviations
from quadpips_drake.baselines.motion_models.state import PAIRS
from tests.baselines.motion_models.planner.worlds import sluggish, standing


def test_deviations_are_those_of_many_walks():
    models, rng, steps, command = sluggish(), np.random.default_rng(4), 4, np.array([0.4, 0.0, 0.0])
    ends = []
    for _ in range(3000):
        state, landed = standing(), []
        for _ in range(steps):
            error = rng.multivariate_normal(np.zeros(8), models.covariance[state.swing])
            state = state.after(command, models.predict(state.inputs(command), state.swing) + error)
            landed.append([state.feet_W[leg] for leg in PAIRS[1 - state.swing]])
        ends.append(landed)
    measured = np.array(ends).std(axis=0).max(axis=-1)
    np.testing.assert_allclose(foothold_deviations(models, 0, steps), measured, rtol=0.06)


def test_margins_grow_with_errors_and_along_the_horizon():
    models = sluggish()
    deviations = foothold_deviations(models, 1, 7)
    assert (np.diff(deviations[:, 0]) >= -1e-12).all() and deviations[6, 0] > deviations[0, 0]
    assert deviations[0, 0] == pytest.approx(0.008)
    np.testing.assert_array_equal(clearances(models, 1, 7, 0.02, 0.0), np.full((7, 2), 0.02))
    np.testing.assert_allclose(clearances(models, 1, 7, 0.0, 2.0), 2.0 * deviations)
    assert clearances(models, 1, 7, 0.02, 2.0).min() == 0.02
