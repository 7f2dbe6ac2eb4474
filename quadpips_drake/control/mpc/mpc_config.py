"""Settings of the MPC."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.framework.stage_config import StageConfig
from quadpips_drake.trajectory.ocp.ocp_config import OcpConfig
from quadpips_drake.trajectory.swing.swing_trajectory import SwingConfig

GRIDS = ("graded", "uniform")


@dataclass
class MpcConfig(StageConfig):
    """Horizon of the MPC, what it does when it fails, and faults to be simulated."""

    rate: float = 50.0
    """How often it solves [Hz] (QuadPiPS: 50)."""

    horizon: float = 1.0
    """Length [s] (QuadPiPS: 1.0)."""
    grid: str = "graded"
    """graded: ``intervals`` that grow geometrically from ``first_interval``; uniform: steps of ``uniform_interval``."""
    intervals: int = 22
    """Number of intervals of the graded grid [1]."""
    first_interval: float = 0.02
    """Length of the first interval of the graded grid [s]."""
    uniform_interval: float = 0.015
    """Length of the intervals of the uniform grid [s] (QuadPiPS: 0.015, 67 of them)."""
    max_consecutive_failures: int = 10
    """After so many failed solves in a row the reference is dropped for standing [1]."""
    delay: float = 0.0
    """A solution is handed on so long after the measurement that it started from [s]; its own times stay what they are."""
    fault_start: list[float] = field(default_factory=list)
    """Times at which the solver begins to fail [s], for studies of faults."""
    fault_duration: float = 0.1
    """How long it fails each time [s]."""
    terrain_height_error: float = 0.0
    """So much higher than they are the footholds' heights are taken to be [m], for studies; negative: lower."""
    ocp: OcpConfig = field(default_factory=OcpConfig)
    """Weights and limits of the optimal control problem."""
    swing: SwingConfig = field(default_factory=SwingConfig)
    """Shape of the swings."""

    def __post_init__(self):
        super().__post_init__()
        if self.grid not in GRIDS:
            raise unknown_name("MPC grid", self.grid, GRIDS)
        if min(self.horizon, self.first_interval, self.uniform_interval) <= 0.0 or self.intervals < 2:
            raise UserInputError("mpc needs a positive horizon, first_interval and uniform_interval, and >= 2 intervals")
        if self.uniform_interval > 0.5 * self.horizon:
            raise UserInputError("mpc.uniform_interval must be at most half the horizon")
        if self.delay < 0.0 or self.delay >= self.horizon:
            raise UserInputError(f"mpc.delay must be >= 0 and shorter than the horizon, not {self.delay}")
        if not abs(self.terrain_height_error) <= 0.5:
            raise UserInputError(f"mpc.terrain_height_error must be -0.5..0.5 m, not {self.terrain_height_error}")
        if self.fault_duration < 0.0 or self.max_consecutive_failures < 0:
            raise UserInputError("mpc.fault_duration and mpc.max_consecutive_failures must not be negative")

    def knots(self) -> np.ndarray:
        """Knots of the grid, from 0 to the horizon [s], (N + 1,)."""
        if self.grid == "uniform":
            return np.linspace(0.0, self.horizon, round(self.horizon / self.uniform_interval) + 1)
        return graded_grid(self.first_interval, self.horizon, self.intervals)

    def is_faulty(self, time: float) -> bool:
        """Whether the solver is to fail at ``time`` [s]."""
        return any(0.0 <= time - start + 1e-9 < self.fault_duration for start in self.fault_start)


def graded_grid(first_step: float, horizon: float, intervals: int) -> np.ndarray:
    """Knots from 0 to ``horizon`` [s], (intervals + 1,); steps grow geometrically from ``first_step``.

    Near steps decide what is done until the next solve; far ones only show where it leads.
    """
    if first_step * intervals >= horizon:
        return np.linspace(0.0, horizon, intervals + 1)
    low, high = 1.0, 3.0
    for _ in range(60):
        ratio = 0.5 * (low + high)
        total = first_step * np.sum(ratio ** np.arange(intervals))
        low, high = (ratio, high) if total < horizon else (low, ratio)
    steps = first_step * low ** np.arange(intervals)
    return np.concatenate(([0.0], np.cumsum(steps) * horizon / steps.sum()))
