"""Gaits as data: which feet are down in which part of a cycle, and contact schedules made from them."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.framework.registry import Registry
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import NUM_LEGS, Leg


@dataclass(frozen=True)
class Gait:
    """A cycle of contact modes. Mode ``i`` ends ``end_times[i]`` [s] after the start of the cycle."""

    name: str
    modes: tuple[tuple[Leg, ...], ...]
    """The feet in stance in each mode."""
    end_times: tuple[float, ...]
    """Increasing [s]; the last one is the duration of the cycle."""

    @property
    def duration(self) -> float:
        """Length of one cycle [s]."""
        return self.end_times[-1]

    @property
    def stance(self) -> np.ndarray:
        """Stance flags of each mode, bool (m, 4)."""
        flags = np.zeros((len(self.modes), NUM_LEGS), dtype=bool)
        for i, legs in enumerate(self.modes):
            flags[i, list(legs)] = True
        return flags

    def schedule(self, start: float, stop: float = np.inf, until: float = np.inf) -> ContactSchedule:
        """Contacts of a robot that stands, walks in this gait from ``start`` on, and stands again.

        Args:
            start: beginning of the first cycle [s].
            stop: the walk ends with the first complete cycle at or after this time [s].
            until: how far the schedule has to be worked out [s]; needed when ``stop`` is infinite.

        Returns:
            A schedule in absolute time that is right up to ``until``. The gait's own all-feet-down modes are kept.
        """
        tolerance = 1e-9
        end = min(stop, until)
        if not np.isfinite(end):
            raise ValueError("a gait without an end needs a finite 'until'")
        cycles = max(0, int(np.ceil((end - start) / self.duration - tolerance)))
        if cycles == 0:
            return ContactSchedule.standing()
        times = (start + self.duration * np.arange(cycles)[:, None] + np.asarray(self.end_times)[None, :]).ravel()
        down = np.ones((1, NUM_LEGS), dtype=bool)
        return ContactSchedule(
            np.concatenate(([start], times)), np.concatenate((down, np.tile(self.stance, (cycles, 1)), down))
        )


def _gait(name: str, modes: str, *end_times: float) -> Gait:
    """``modes`` lists the stance feet of each mode, as in "LF+RH all none"."""
    shorthand = {"all": tuple(Leg), "none": ()}
    parsed = tuple(shorthand[m] if m in shorthand else tuple(Leg[leg] for leg in m.split("+")) for m in modes.split())
    return Gait(name, parsed, end_times)


GAITS = {
    gait.name: gait
    for gait in (
        _gait("stance", "all", 1.0),
        _gait("standing_trot", "LF+RH all RF+LH all", 0.40, 0.50, 0.90, 1.00),
        _gait(
            "standing_walk", "LF+RF+RH all RF+LH+RH all LF+RF+LH all LF+LH+RH all", 0.4, 0.5, 0.9, 1.0, 1.4, 1.5, 1.9, 2.0
        ),
        _gait("slow_trot", "LF+RH all RF+LH all", 0.3, 0.5, 0.8, 1.0),
        _gait("trot", "LF+RH RF+LH", 0.30, 0.60),
        _gait("flying_trot", "LF+RH none RF+LH none", 0.27, 0.30, 0.57, 0.60),
        _gait("pace", "LF+LH none RF+RH none", 0.28, 0.30, 0.58, 0.60),
        _gait("standing_pace", "LF+LH all RF+RH all", 0.30, 0.35, 0.65, 0.70),
        _gait("static_walk", "LF+RF+RH RF+LH+RH LF+RF+LH LF+LH+RH", 0.3, 0.6, 0.9, 1.2),
        _gait("dynamic_walk", "LF+RF+RH RF+RH RF+LH+RH LF+RF+LH LF+LH LF+LH+RH", 0.2, 0.3, 0.5, 0.7, 0.8, 1.0),
        _gait("amble", "RF+LH LF+LH LF+RH RF+RH", 0.15, 0.40, 0.55, 0.80),
    )
}
"""The gaits of the authors' configuration (times in which each mode ends, after OCS2's gait files)."""


gaits = Registry("gait", "quadpips_drake.gaits")
"""``factory()`` returns a Gait."""

for _name in GAITS:
    gaits.add(_name, lambda name=_name: GAITS[name])


def gait_names() -> list[str]:
    """The known names, in alphabetical order."""
    return gaits.names()


def load_gait(name: str) -> Gait:
    """Returns the gait of that name; an unknown one is a UserInputError that lists the known ones."""
    return gaits.get(name).factory()


def gait_number(name: str) -> int:
    """How logs name a gait: its place among those of this package, then among all others in alphabetical order."""
    own = list(GAITS)
    if name in GAITS:  # without a look at the packages that are installed, which takes milliseconds
        return own.index(name)
    return len(own) + [other for other in gaits.names() if other not in GAITS].index(name)
