"""Steppability labels (QuadPiPS section V-B)."""

from enum import IntEnum


class Steppability(IntEnum):
    """What a foot may do with a piece of the world."""

    UNKNOWN = 0
    STEPPABLE = 1
    """Carries a stable foothold."""
    PASSABLE = 2
    """Carries no foothold, but a swinging foot clears it."""
    NON_PASSABLE = 3
    """Carries no foothold and is too high to swing over."""
