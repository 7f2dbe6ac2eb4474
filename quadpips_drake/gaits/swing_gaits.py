"""The order in which legs swing, as the foothold search sees a gait: swing phases with all feet down in between."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.errors import unknown_name
from quadpips_drake.gaits.gaits import Gait, gaits, load_gait
from quadpips_drake.values.legs import Leg

_DIGITS = 9
"""Durations are differences of times; rounded to so many digits [s] they are the numbers that were meant."""


@dataclass(frozen=True)
class SwingGait:
    """A cycle of swing phases, each of ``swing_duration`` and followed by ``stance_duration`` on all feet [s]."""

    name: str
    phases: tuple[tuple[Leg, ...], ...]
    """The legs that swing together, phase by phase."""
    swing_duration: float
    stance_duration: float


def swing_gait_names() -> tuple[str, ...]:
    """Returns the names that ``swing_gait`` knows.

    They are those of the gaits that stand on all feet after every swing phase, and in it on more than one side or end.
    """
    return tuple(name for name in gaits.names() if _swing_phases(load_gait(name)) is not None)


def swing_gait(name: str) -> SwingGait:
    """Returns the gait called ``name`` as swing phases; raises UserInputError for one that is unknown or has none."""
    found = _swing_phases(load_gait(name)) if name in gaits else None
    if found is None:
        raise unknown_name("planning gait", name, swing_gait_names())
    return found


def _swing_phases(gait: Gait) -> SwingGait | None:
    """The gait as swing phases; None where its modes are no swings of equal length with equal stances in between.

    Nor is it one where all feet of a side (pace) or an end (bound) swing at once: no base hangs over the feet that remain.
    """
    swinging = [tuple(leg for leg in Leg if leg not in down) for down in gait.modes]
    lengths = np.round(np.diff((0.0, *gait.end_times)), _DIGITS)
    swings, stances = swinging[::2], swinging[1::2]
    if len(swings) != len(stances) or any(stances) or not all(_is_carried(legs) for legs in swings):
        return None
    if len(set(lengths[::2])) > 1 or len(set(lengths[1::2])) > 1:
        return None
    return SwingGait(gait.name, tuple(swings), float(lengths[0]), float(lengths[1]))


def _is_carried(swinging: tuple[Leg, ...]) -> bool:
    """Whether some legs swing, and those that stand are on both sides and at both ends of the robot."""
    standing = [leg for leg in Leg if leg not in swinging]
    return len(swinging) > 0 and {leg.side for leg in standing} == {leg.fore for leg in standing} == {1, -1}
