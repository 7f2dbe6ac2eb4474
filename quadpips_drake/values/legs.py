"""The four legs, in the one order that is used everywhere."""

from enum import IntEnum

NUM_LEGS = 4
JOINTS_PER_LEG = 3
NUM_JOINTS = NUM_LEGS * JOINTS_PER_LEG


class Leg(IntEnum):
    """LF, RF, LH, RH: left or right, fore or hind. The value indexes every array with a leg axis."""

    LF = 0
    RF = 1
    LH = 2
    RH = 3

    @property
    def side(self) -> int:
        """+1 for a left leg, -1 for a right one (the sign of its hip's y)."""
        return 1 if self in (Leg.LF, Leg.LH) else -1

    @property
    def fore(self) -> int:
        """+1 for a fore leg, -1 for a hind one (the sign of its hip's x)."""
        return 1 if self in (Leg.LF, Leg.RF) else -1

    @property
    def joints(self) -> slice:
        """This leg's slice (HAA, HFE, KFE) of a vector of 12 joint values."""
        return slice(JOINTS_PER_LEG * self, JOINTS_PER_LEG * (self + 1))
