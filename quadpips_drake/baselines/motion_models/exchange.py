"""Exchanges of the feet, found in their contacts alone: when a step ends and the next one begins.

A step ends when both feet of the diagonal pair that swung are down again, after both have been off the ground; or, where
one of them was not felt, when the other pair is off. In a trot without overlap that is the moment in which the pairs
change, in one with full stances the beginning of a full stance. Out of standing the first step begins with the first
lift-off.
"""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.baselines.motion_models.state import PAIRS

SAMPLE_RATE = 200.0
"""How often contacts are looked at [Hz], when data are collected and when a planner walks: a step's length counts from what
is seen, and a coarser look adds errors of the base's position."""
MIN_SWING = 0.1
"""A pair that comes down sooner than this [s] after it was off has not swung: a foot scuffs or bounces."""
STANDING_TIME = 0.4
"""After so long on all feet [s] the robot stands: no step is under way."""
NOBODY = -1
"""Swing of a robot that stands."""


@dataclass(frozen=True)
class ExchangeMemory:
    """What finding exchanges remembers; begins as ``ExchangeMemory()``."""

    swing: int = NOBODY
    """Which of PAIRS swings in the present step, or will as soon as it is lifted; NOBODY: the robot stands."""
    lifted: float = np.inf
    """When both its feet were off first [s]; infinite: they have not been yet."""
    began: float = -np.inf
    """When the present step began [s]."""
    full_stance_since: float = np.inf
    """Since when all feet have been down [s]; infinite while they are not."""
    count: int = 0
    """Steps begun so far, first lift-offs out of standing among them."""


def look_for_exchange(memory: ExchangeMemory, stamp: float, contacts: np.ndarray) -> tuple[ExchangeMemory, bool]:
    """The next memory, and whether a step begins now: then ``swing`` of the memory says which pair swings in it.

    Args:
        memory: of the last look.
        stamp: time [s], SAMPLE_RATE after each other.
        contacts: which feet touch the ground, bool (4,).
    """
    off = [not contacts[list(pair)].any() for pair in PAIRS]
    all_down = bool(contacts.all())
    memory = replace(memory, full_stance_since=min(memory.full_stance_since, stamp) if all_down else np.inf)
    if memory.swing == NOBODY:
        if off[0] == off[1]:
            return memory, False
        return _begun(memory, off.index(True), stamp, lifted=stamp), True
    if stamp - memory.full_stance_since >= STANDING_TIME:
        return replace(memory, swing=NOBODY, lifted=np.inf), False
    swing = memory.swing
    if memory.lifted == np.inf:
        if off[1 - swing] and not off[swing] and stamp - memory.began >= MIN_SWING:
            return _begun(memory, 1 - swing, stamp, lifted=stamp), True  # the same pair once more: a gait begins anew
        return (replace(memory, lifted=stamp) if off[swing] else memory), False
    other_is_off = off[1 - swing] and not off[swing]
    is_down = contacts[list(PAIRS[swing])].all()
    if stamp - memory.lifted < MIN_SWING or not (is_down or other_is_off):
        return memory, False
    return _begun(memory, 1 - swing, stamp, lifted=stamp if off[1 - swing] else np.inf), True


def _begun(memory: ExchangeMemory, swing: int, stamp: float, lifted: float) -> ExchangeMemory:
    return replace(memory, swing=swing, lifted=lifted, began=stamp, count=memory.count + 1)
