"""Wrapping of angles."""

import numpy as np
import pytest

from quadpips_drake.math.angles import whole_turns, wrap_angle


def test_angles_are_wrapped_to_one_turn():
    assert wrap_angle(3.5) == pytest.approx(3.5 - 2.0 * np.pi)
    assert wrap_angle(np.pi) == np.pi
    assert wrap_angle(-np.pi) == np.pi
    angles = np.linspace(-20.0, 20.0, 401)
    wrapped = wrap_angle(angles)
    assert ((wrapped > -np.pi) & (wrapped <= np.pi)).all()
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)


def test_whole_turns_bring_one_angle_close_to_another():
    assert whole_turns(0.5) == 0.0
    assert 0.3 + whole_turns(13.0 - 0.3) == pytest.approx(0.3 + 4.0 * np.pi)
    assert list(whole_turns(np.array([-7.0, 3.0, 4.0])) / (2.0 * np.pi)) == [-1.0, 0.0, 1.0]
