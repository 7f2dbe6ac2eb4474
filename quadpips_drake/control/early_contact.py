"""When a foot that touches the ground before its time has come down: one rule for the MPC and whole-body control.

Early in a swing a touch is the ground that the foot has just left, or an edge on its way; late in it, the touch-down.
"""

from numba import njit

EARLY_CONTACT_PHASE = 0.6
"""From this part of a swing on a touch counts as touch-down [1]; the default of the key ``wbc.early_contact_phase``."""


@njit(cache=True)
def counts_as_touchdown(start: float, end: float, time: float, phase: float) -> bool:
    """Whether a touch at ``time`` [s] in a swing from ``start`` to ``end`` [s] comes after the part ``phase`` of it [1]."""
    return time > start + phase * (end - start)
