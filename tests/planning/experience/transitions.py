"""Transitions by hand: a stance, and one or two feet that move."""

import numpy as np

from quadpips_drake.planning.experience.learning import TriedSwing
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.swing_plan import SwingOutcome

STANCE = np.array([[0.36, 0.17, 0.0], [0.36, -0.17, 0.0], [-0.36, 0.17, 0.0], [-0.36, -0.17, 0.0]])
"""Of a robot at the origin [m]."""
PAIR = (Leg.LF, Leg.RH)


def moved(feet, legs=PAIR, by=(0.3, 0.0, 0.0)) -> np.ndarray:
    """The feet after some of them moved ``by`` [m]."""
    after = np.array(feet)
    after[[int(leg) for leg in legs]] += by
    return after


def tried(cost=-33.0, outcome=SwingOutcome.CONVERGED, legs=PAIR, before=STANCE, by=(0.3, 0.0, 0.0), phase=0) -> TriedSwing:
    """An attempt at a swing of ``legs``."""
    return TriedSwing(phase, legs, np.array(before), moved(before, legs, by), outcome, cost)
