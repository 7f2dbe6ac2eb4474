"""Settings of the MPC."""

from dataclasses import field

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.control.mpc.foothold_shift import FootholdShiftConfig
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.trajectory.ocp.ocp_config import OcpConfig
from quadpips_drake.trajectory.swing.swing_trajectory import SwingConfig

GRIDS = ("graded", "uniform")

MAX_INTERVALS = 200
"""Longest grid: a solve takes some 0.5 ms per interval."""


@configuration
class MpcConfig(StageConfig):
    """Rate and horizon of the MPC, and what it does when it fails."""

    rate: float = stage_rate(50.0)
    """How often it solves [Hz] (QuadPiPS: 50)."""

    horizon: float = ranged(1.0, 0.1, 5.0)
    """Length [s] (QuadPiPS: 1.0)."""
    grid: str = "graded"
    """graded: ``intervals`` that grow geometrically from ``first_interval``; uniform: steps of ``uniform_interval``."""
    intervals: int = ranged(22, 2, MAX_INTERVALS)
    """Number of intervals of the graded grid [1]."""
    first_interval: float = ranged(0.02, 0.001, 1.0)
    """Length of the first interval of the graded grid [s]."""
    uniform_interval: float = ranged(0.015, 0.001, 1.0)
    """Length of the intervals of the uniform grid [s] (QuadPiPS: 0.015, 67 of them)."""
    max_consecutive_failures: int = ranged(10, 0, 1_000_000)
    """After so many failed solves in a row the reference is dropped for standing [1]."""
    ocp: OcpConfig = field(default_factory=OcpConfig)
    """Weights and limits of the optimal control problem."""
    swing: SwingConfig = field(default_factory=SwingConfig)
    """Shape of the swings."""
    footholds: FootholdShiftConfig = field(default_factory=FootholdShiftConfig)
    """How far coming footholds move with the robot."""

    def __post_init__(self):
        super().__post_init__()
        if self.grid not in GRIDS:
            raise unknown_name("MPC grid", self.grid, GRIDS)
        if not 2 <= self.horizon / self.uniform_interval <= MAX_INTERVALS:
            raise UserInputError(
                f"uniform_interval must be 1/{MAX_INTERVALS} to 1/2 of the horizon, not {self.uniform_interval:g} s"
            )
        if self.latency >= self.horizon:
            raise UserInputError(f"latency must be shorter than the horizon, {self.horizon:g} s, not {self.latency:g} s")

    def knots(self) -> np.ndarray:
        """Knots of the grid, from 0 to the horizon [s], (N + 1,)."""
        if self.grid == "uniform":
            return np.linspace(0.0, self.horizon, round(self.horizon / self.uniform_interval) + 1)
        return graded_grid(self.first_interval, self.horizon, self.intervals)


def walking_mpc() -> MpcConfig:
    """The MPC of a walk by velocity command: roll weighs as much as pitch.

    With the weights of the authors (100 against 300), which are right where footholds are given, the MPC leans the robot
    sideways to be where the reference is, although the next steps will put its feet there anyway.
    """
    config = MpcConfig()
    config.ocp.weights.base_orientation = [300.0, 300.0, 300.0]
    config.ocp.weights.angular_velocity = [30.0, 30.0, 30.0]
    return config


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
