"""The ground as a plane, estimated from where the feet stand."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue

_MAX_SLOPE = 0.7
"""Largest slope that is believed, along x and along y [1]."""


@dataclass(frozen=True, eq=False)
class GroundPlane(ImmutableValue):
    """z = height + slope . (xy - origin), in W."""

    origin: np.ndarray
    """xy [m], (2,)."""
    height: float
    """[m]"""
    slope: np.ndarray
    """dz/dx and dz/dy [1], (2,)."""

    def at(self, xy: np.ndarray) -> np.ndarray:
        """Height [m] below points ``xy`` (..., 2) [m]."""
        return self.height + (np.asarray(xy) - self.origin) @ self.slope

    @cached_property
    def normal(self) -> np.ndarray:
        """Upward unit normal, (3,)."""
        normal = np.array([-self.slope[0], -self.slope[1], 1.0])
        return normal / np.sqrt(normal @ normal)

    def inclination(self, yaw) -> np.ndarray:
        """Roll and pitch [rad] of a body that is parallel to the plane and turned by ``yaw`` [rad]; (2,) or (n, 2)."""
        n = self.normal
        ahead = np.cos(yaw) * n[0] + np.sin(yaw) * n[1]
        left = -np.sin(yaw) * n[0] + np.cos(yaw) * n[1]
        return np.stack((-np.arcsin(left), np.arctan2(ahead, n[2])), axis=-1)

    def improved(self, points: np.ndarray, origin: np.ndarray, height_gain: float, slope_gain: float) -> "GroundPlane":
        """The plane, moved towards the one that fits ``points`` best.

        Args:
            points: where the ground was touched last by each foot, in W [m], (n, 3).
            origin: the new origin [m], (2,).
            height_gain, slope_gain: how far to go, 0 (not at all) to 1 (all the way).
        """
        offsets = points[:, :2] - origin
        expected = self.at(origin)
        basis = np.column_stack((np.ones(len(points)), offsets))
        # A little regularisation keeps the old slope where the feet stand almost on one line.
        weight = 1e-3 * np.eye(3)
        prior = np.array([expected, *self.slope])
        fit = np.linalg.solve(basis.T @ basis + weight, basis.T @ points[:, 2] + weight @ prior)
        slope = self.slope + slope_gain * (np.clip(fit[1:], -_MAX_SLOPE, _MAX_SLOPE) - self.slope)
        return GroundPlane(np.array(origin, float), float(expected + height_gain * (fit[0] - expected)), slope)


def fitted_plane(points: np.ndarray, origin: np.ndarray) -> GroundPlane:
    """The plane through ``points`` (n, 3) [m] in the least-squares sense, about ``origin`` (2,) [m]."""
    level = GroundPlane(np.array(origin, float), float(points[:, 2].mean()), np.zeros(2))
    return level.improved(points, origin, 1.0, 1.0)
