"""Regions from nowhere: a carpet of squares that is taken to lie around the robot."""

from dataclasses import dataclass

import numpy as np

import quadpips_drake as qp


@dataclass
class CarpetConfig(qp.StageConfig):
    """The carpet."""

    rate: float = 10.0
    """How often it is rolled out anew [Hz]."""
    side: float = 0.5
    """Of a square [m]."""
    squares: int = 11
    """Along each edge [1]."""


class Carpet(qp.Stage):
    """Puts squares at the height of the ground under the feet."""

    def __init__(self, setup: qp.RegionSourceSetup):
        super().__init__("carpet", setup.config, memory=qp.RegionSet.empty(), timings=setup.timings)
        self._robot = setup.robot
        self.declare_input("robot_state", qp.RobotState)
        self.declare_output("region_set", qp.RegionSet)

    def update(self, inputs, memory: qp.RegionSet, time: float) -> qp.RegionSet:
        """Rolls it out around the robot, at places that do not move with it."""
        state, side = inputs.robot_state, self.config.side
        height = (self._robot.foot_positions_W(state)[:, 2] - self._robot.foot_radius).mean()
        middle = np.round(state.p_WB[:2] / side).astype(int)
        reach = self.config.squares // 2
        half = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        regions = []
        for i in range(middle[0] - reach, middle[0] + reach + 1):
            for j in range(middle[1] - reach, middle[1] + reach + 1):
                X_WR = np.eye(4)
                X_WR[:3, 3] = [i * side, j * side, height]
                number = 10_000 * (i + 5_000) + j + 5_000
                regions.append(qp.PlanarRegion(number, X_WR, half, 0.9 * half, int(qp.Steppability.STEPPABLE)))
        return qp.RegionSet(state.stamp, tuple(regions))


ENTRY = qp.Entry(Carpet, CarpetConfig, "squares around the robot, whatever there is")
