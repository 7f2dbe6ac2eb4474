"""State and input of the centroidal model: what stands where in their 24 numbers each."""

import numpy as np

from quadpips_drake.values.legs import NUM_LEGS

STATE_SIZE = 24
INPUT_SIZE = 24


class CentroidalState:
    """Slices of a state x, (24,), or of the last axis of many, (n, 24): ``x[CentroidalState.POSITION]``.

    Compiled code takes them too, through a constant of its module.
    """

    LINEAR = slice(0, 3)
    """Linear momentum / mass, that is the velocity of the centre of mass, in W [m/s]."""
    ANGULAR = slice(3, 6)
    """Angular momentum about the centre of mass / mass, in W [m^2/s]."""
    MOMENTUM = slice(0, 6)
    """Both of them."""
    POSITION = slice(6, 9)
    """Position of the base p_WB [m]."""
    ORIENTATION = slice(9, 12)
    """Roll, pitch, yaw of the base [rad]."""
    JOINTS = slice(12, 24)
    """Joint positions [rad]."""
    CONFIGURATION = slice(6, 24)
    """Position, orientation and joints: everything but the momentum."""
    YAW = 11
    """Index of the yaw."""


class CentroidalInput:
    """Slices of an input u, (24,), or of the last axis of many, (n, 24)."""

    FORCES = slice(0, 12)
    """Force of the ground on each foot in W [N], leg by leg."""
    VERTICAL_FORCES = slice(2, 12, 3)
    """Their components along z of W."""
    JOINT_VELOCITIES = slice(12, 24)
    """[rad/s]"""


def centroidal_state(p_WB, rpy_WB, joints, momentum=0.0) -> np.ndarray:
    """Returns the state x (24,) with that base pose [m, rad] and joints [rad]; ``momentum`` (6,) per mass, or at rest."""
    x = np.empty(STATE_SIZE)
    x[CentroidalState.MOMENTUM] = momentum
    x[CentroidalState.POSITION] = p_WB
    x[CentroidalState.ORIENTATION] = rpy_WB
    x[CentroidalState.JOINTS] = joints
    return x


def foot_forces(inputs: np.ndarray) -> np.ndarray:
    """Returns the forces on the feet in W [N], (..., 4, 3), of inputs (..., 24); of one input it is a view."""
    return inputs[..., CentroidalInput.FORCES].reshape(*inputs.shape[:-1], NUM_LEGS, 3)
