"""What sensors measure, and with what."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_LEGS


@dataclass(frozen=True)
class CameraIntrinsics:
    """Pinhole model: pixel (u, v) = (fx x / z + cx, fy y / z + cy) in the optical frame C (x right, y down, z forward)."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True, eq=False)
class FootContacts(ImmutableValue):
    """What the feet feel."""

    stamp: float
    """Time of the measurement [s]."""
    forces: np.ndarray
    """Force of the ground on each foot in W [N], (4, 3)."""
    contacts: np.ndarray
    """Whether each foot touches the ground, bool, (4,)."""

    @staticmethod
    def empty() -> "FootContacts":
        """Nothing was felt yet."""
        return FootContacts(-np.inf, np.zeros((NUM_LEGS, 3)), np.zeros(NUM_LEGS, dtype=bool))
