"""References of walks for tests of what comes after planning."""

import numpy as np

from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.reference import WholeBodyReference


def trot(request_id, begin, steps, x):
    """A reference of ``steps`` swings of 0.5 s from ``begin`` [s] on, which leads the base to ``x`` [m]."""
    times = begin + 0.1 * np.arange(5 * steps + 1)
    states = np.zeros((len(times), 24))
    states[:, CentroidalState.POSITION] = np.linspace([0.0, 0.0, 0.58], [x, 0.0, 0.58], len(times))
    ends = begin + 0.5 * np.arange(steps)
    events = np.column_stack((ends + 0.05, ends + 0.45)).ravel()
    stance = np.ones((2 * steps + 1, 4), dtype=bool)
    stance[1::2, [0, 3]] = False
    return WholeBodyReference(begin, request_id, times, states, np.zeros((len(times), 24)), ContactSchedule(events, stance))
