"""WalkVisualizer: the commanded velocity as an arrow at the robot, in Meshcat and in recordings."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RollPitchYaw

from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.visualization.meshcat_layers import ROOT, MeshcatLayers
from quadpips_drake.visualization.meshes.arrows import command_mesh

_ABOVE = 0.35
"""Where the command's arrow floats above the base [m]."""
_STEP = 0.02
"""A command is drawn anew when a component has changed by so much [m/s, rad/s]..."""
_PAUSE = 0.2
"""... and the last drawing is this old [s]: a recording keeps each."""


@dataclass(frozen=True, eq=False)
class _Shown(ImmutableValue):
    """What is on show."""

    number: int = 0
    command: tuple = ()
    time: float = -np.inf


class WalkVisualizer(LeafSystem):
    """Draws the commanded velocity into Meshcat as an arrow that goes with the robot.

    .. pydrake_system::

        name: WalkVisualizer
        input_ports:
        - robot_state
        - velocity_command

    - robot_state: RobotState, frame W; read at 1 / ``period``.
    - velocity_command: forward, left [m/s], yaw rate [rad/s] in the robot's heading frame, vector (3,).
    """

    def __init__(self, robot, meshcat: Meshcat, *, period: float = 1 / 32, keep_history=True):
        """
        Args:
            robot: the robot.
            meshcat: where to draw.
            period: time between two looks [s].
            keep_history: whether commands that are out of date are hidden (a recording can show them again) or deleted.
        """
        super().__init__()
        self.set_name("walk_visualizer")
        self._meshcat, self._layers = meshcat, MeshcatLayers(meshcat, keep_history=keep_history)
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(standing_state(robot)))
        self._command = self.DeclareVectorInputPort("velocity_command", 3)
        self._shown = self.DeclareAbstractState(AbstractValue.Make(_Shown()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._look)

    def _look(self, context, state):
        time, robot = context.get_time(), self._robot_state.Eval(context)
        before = context.get_abstract_state(int(self._shown)).get_value()
        heading = RigidTransform(RollPitchYaw(0, 0, robot.rpy_WB[2]), robot.p_WB + np.array([0, 0, _ABOVE]))
        self._meshcat.SetTransform(f"{ROOT}/command", heading, time)
        command = tuple(np.round(self._command.Eval(context) / _STEP).astype(int).tolist())
        if command == before.command or time - before.time < _PAUSE - 1e-9:
            return
        self._layers.replace("command", before.number + 1, command_mesh(_STEP * np.array(command)), time)
        state.get_mutable_abstract_state(int(self._shown)).set_value(_Shown(before.number + 1, command, time))
