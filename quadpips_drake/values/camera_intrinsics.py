"""The pinhole model of a camera."""

from dataclasses import dataclass


@dataclass(frozen=True)
class CameraIntrinsics:
    """Pinhole model: pixel (u, v) = (fx x / z + cx, fy y / z + cy) in the optical frame C (x right, y down, z forward)."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
