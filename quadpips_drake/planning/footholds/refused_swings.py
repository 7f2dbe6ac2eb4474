"""Transitions that the swing optimisation refused: what looks like them is no edge of the search any more."""

import numpy as np

_SAME_START = 0.03
"""Stances whose feet are all closer to each other than this [m] are the same to start from: the robot is measured anew."""
_SAME_END = 0.04
"""Footholds closer to each other than this [m] are the same to swing to: what fails here fails a little further on, too."""


def are_refused(refused, legs, start: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Which transitions are like one that was refused, bool (k,).

    Args:
        refused: RefusedSwings.
        legs: that swing.
        start: ground points of the feet before [m], (4, 3).
        ends: ... and after each transition [m], (k, 4, 3).
    """
    alike = np.zeros(len(ends), dtype=bool)
    for swing in refused:
        if set(swing.legs) != set(legs) or np.linalg.norm(swing.start - start, axis=1).max() >= _SAME_START:
            continue
        moved = [int(leg) for leg in legs]
        alike |= (np.linalg.norm(ends[:, moved] - swing.end[moved], axis=2) < _SAME_END).all(axis=1)
    return alike
