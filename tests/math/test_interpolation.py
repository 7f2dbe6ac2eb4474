"""Interpolation against NumPy's, column by column."""

import numpy as np

from quadpips_drake.math.interpolation import interpolated


def test_linear_in_between_and_constant_outside():
    rng = np.random.default_rng(0)
    knots, values = np.cumsum(rng.uniform(0.01, 0.2, 12)), rng.normal(size=(12, 5))
    times = np.sort(np.concatenate((np.linspace(knots[0] - 0.1, knots[-1] + 0.1, 40), knots)))
    expected = np.stack([np.interp(times, knots, column) for column in values.T], axis=1)
    np.testing.assert_allclose(interpolated(times, knots, values), expected, atol=1e-13)
