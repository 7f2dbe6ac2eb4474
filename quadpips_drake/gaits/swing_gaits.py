"""The order in which legs swing, as the foothold search sees a gait: swing phases with all feet down in between."""

from dataclasses import dataclass

from quadpips_drake.errors import unknown_name
from quadpips_drake.values.legs import Leg


@dataclass(frozen=True)
class SwingGait:
    """A cycle of swing phases, each of ``swing_duration`` and followed by ``stance_duration`` on all feet [s]."""

    name: str
    phases: tuple[tuple[Leg, ...], ...]
    """The legs that swing together, phase by phase."""
    swing_duration: float
    stance_duration: float


_TROT = ((Leg.RF, Leg.LH), (Leg.LF, Leg.RH))
_WALK = ((Leg.LH,), (Leg.LF,), (Leg.RH,), (Leg.RF,))

_GAITS = {
    gait.name: gait
    for gait in (
        SwingGait("standing_trot", _TROT, 0.4, 0.1),
        SwingGait("slow_trot", _TROT, 0.3, 0.2),
        SwingGait("standing_walk", _WALK, 0.4, 0.1),
    )
}


def swing_gait_names() -> tuple[str, ...]:
    """Returns the names that ``swing_gait`` knows."""
    return tuple(_GAITS)


def swing_gait(name: str) -> SwingGait:
    """Returns the gait called ``name``; raises UserInputError for an unknown one."""
    if name not in _GAITS:
        raise unknown_name("planning gait", name, _GAITS)
    return _GAITS[name]
