"""Rotations agree with Drake's and with finite differences."""

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RollPitchYaw, RotationMatrix

from quadpips_drake.math.rotations import (
    attitude_from_quaternion,
    body_rates,
    roll_pitch_yaw_rates,
    rotation_derivatives,
    rotation_from_rpy,
    yaw_matrix,
)

ANGLES = np.random.default_rng(0).uniform([-3.0, -1.4, -3.0], [3.0, 1.4, 3.0], (20, 3))
STEP = 1e-6


def test_yaw_turns_about_the_vertical():
    for yaw in ANGLES[:, 2]:
        np.testing.assert_allclose(yaw_matrix(yaw), RotationMatrix.MakeZRotation(yaw).matrix(), atol=1e-15)


@pytest.mark.parametrize("rpy", ANGLES)
def test_roll_pitch_yaw_is_drakes(rpy):
    np.testing.assert_allclose(rotation_from_rpy(rpy), RollPitchYaw(rpy).ToRotationMatrix().matrix(), atol=1e-15)


@pytest.mark.parametrize("rpy", ANGLES[:5])
def test_derivatives_are_differences(rpy):
    rotation, derivatives = rotation_derivatives(rpy)
    np.testing.assert_array_equal(rotation, rotation_from_rpy(rpy))
    for i in range(3):
        step = STEP * np.eye(3)[i]
        difference = (rotation_from_rpy(rpy + step) - rotation_from_rpy(rpy - step)) / (2.0 * STEP)
        np.testing.assert_allclose(derivatives[i], difference, atol=1e-9)
        if i < 2:
            difference = (roll_pitch_yaw_rates(rpy + step)[0] - roll_pitch_yaw_rates(rpy - step)[0]) / (2.0 * STEP)
            np.testing.assert_allclose(roll_pitch_yaw_rates(rpy)[1][i], difference, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("rpy", ANGLES[:5])
def test_rates_and_angular_velocity_belong_together(rpy):
    w_B = np.array([0.3, -0.5, 0.7])
    rates = roll_pitch_yaw_rates(rpy)[0] @ w_B
    np.testing.assert_allclose(body_rates(rpy, rates), w_B, atol=1e-12)
    np.testing.assert_allclose(RollPitchYaw(rpy).CalcAngularVelocityInChildFromRpyDt(rates), w_B, atol=1e-12)


@pytest.mark.parametrize("rpy", ANGLES)
def test_attitudes_come_from_quaternions_of_any_length(rpy):
    quaternion = RollPitchYaw(rpy).ToQuaternion()
    found, rotation = attitude_from_quaternion(1.7 * quaternion.wxyz())
    np.testing.assert_allclose(found, rpy, atol=1e-12)
    np.testing.assert_allclose(rotation, RotationMatrix(Quaternion(quaternion.wxyz())).matrix(), atol=1e-14)
