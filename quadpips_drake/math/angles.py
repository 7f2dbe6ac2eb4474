"""Angles that mean the same when whole turns are added."""

import numpy as np
from numba import njit


@njit(cache=True)
def wrap_angle(angle):
    """Returns ``angle`` [rad], a number or an array, in (-pi, pi]."""
    return np.pi - (np.pi - angle) % (2.0 * np.pi)


def whole_turns(angle):
    """Returns the multiple of 2 pi that is closest to ``angle`` [rad]; to add to another angle so that it comes close."""
    return 2.0 * np.pi * np.rint(angle / (2.0 * np.pi))
