"""What whole-body control tells the drives, and what it thinks of each foot."""

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import NUM_JOINTS, NUM_LEGS


class FootMode(IntEnum):
    """What a foot does."""

    STANCE = 0
    """Planned to be down: bears load."""
    SWING = 1
    """Planned to be in the air: follows its spline."""
    EARLY = 2
    """Touched the ground late in its swing, before the planned time: bears load."""
    SEARCH = 3
    """Should have touched down but feels no ground: is lowered further along the ground's normal."""


@dataclass(frozen=True, eq=False)
class WholeBodyCommand(ImmutableValue):
    """Result of one tick of whole-body control."""

    stamp: float
    """[s]"""
    torque: np.ndarray
    """Feedforward joint torques [N m], (12,)."""
    joint_positions: np.ndarray
    """Set points of the joints' own PD control [rad], (12,)."""
    joint_velocities: np.ndarray
    """[rad/s], (12,)."""
    forces: np.ndarray
    """Ground forces that the torques aim at, in W [N], (4, 3)."""
    foot_modes: np.ndarray
    """FootMode of each foot, int (4,)."""
    status: str
    """"blind" without a state, "standing" without a policy, else the solver's word."""
    success: bool
    fallbacks: int
    """How many ticks since the start had a program that failed."""
    consecutive_failures: int
    iterations: int = 0
    solve_time: float = 0.0
    """Wall-clock time of the tick [s]."""
    warm: object = field(default=None, repr=False)
    """Where the next program starts from."""

    @staticmethod
    def empty() -> "WholeBodyCommand":
        zeros = np.zeros(NUM_JOINTS)
        down = np.full(NUM_LEGS, int(FootMode.STANCE))
        return WholeBodyCommand(-np.inf, zeros, zeros, zeros, np.zeros((NUM_LEGS, 3)), down, "none", True, 0, 0)
