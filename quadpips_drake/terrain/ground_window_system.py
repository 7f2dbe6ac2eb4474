"""Sees to it that the robot does not walk out of the part of a large terrain that can be touched."""

import numpy as np
from pydrake.systems.framework import BasicVector, EventStatus

from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.terrain.ground_window import MAX_STRAY, RECENTRE_AT, GroundWindow

PERIOD = 0.02
"""Between two looks [s]."""


class GroundWindowGuard(LeafSystem):
    """Knows where the window of the ground is, and stops a simulation in which the robot leaves it.

    SceneGraph keeps roles of geometries in parameters, which no event of a diagram may change; so whoever advances the
    simulation moves the window with ``follow`` (SimulationStation.bring_ground_near), and this system raises RuntimeError
    when nobody did: a robot must not fall through ground that is there.

    .. pydrake_system::

        name: GroundWindowGuard
        input_ports:
        - plant_state

    - plant_state: positions and velocities of the plant, vector, sampled every PERIOD.
    """

    def __init__(self, window: GroundWindow, num_states: int, first_position: int):
        """Args: the window; size of the plant's state; index in it of the base's x (y follows)."""
        super().__init__()
        self.set_name("ground_window")
        self._window, self._x = window, first_position
        self._state_port = self.DeclareVectorInputPort("plant_state", num_states)
        # Nowhere, until somebody moves it.
        self._middle = self.DeclareNumericParameter(BasicVector(np.full(2, np.nan)))
        self.DeclarePeriodicPublishEvent(PERIOD, 0.0, self._check)

    def follow(self, context, scene_context) -> None:
        """Moves the window to the robot when it has gone RECENTRE_AT from the middle.

        Args: this system's context; that of the SceneGraph in the same diagram's context.
        """
        if not self._distance(context) <= RECENTRE_AT:
            xy = self._position(context)
            self._window.move(scene_context, xy)
            context.get_mutable_numeric_parameter(self._middle).SetFromVector(xy)

    def _position(self, context) -> np.ndarray:
        return self._state_port.Eval(context)[self._x : self._x + 2]

    def _distance(self, context) -> float:
        """From the middle of the window to the base, the larger of x and y [m]; NaN when there is no window yet."""
        return float(np.abs(self._position(context) - context.get_numeric_parameter(self._middle).value()).max())

    def _check(self, context) -> EventStatus:
        if not self._distance(context) <= MAX_STRAY:
            x, y = self._position(context)
            raise RuntimeError(
                f"the robot at ({x:.2f}, {y:.2f}) has left the ground that can be touched: "
                "call SimulationStation.bring_ground_near at least every 0.2 s"
            )
        return EventStatus.Succeeded()
