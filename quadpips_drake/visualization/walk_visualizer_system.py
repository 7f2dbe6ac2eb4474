"""WalkVisualizer: commanded velocity and pushes as arrows at the robot, in Meshcat and in recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RollPitchYaw

from quadpips_drake.faults.push_system import Push
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.visualization.meshcat_layers import ROOT, MeshcatLayers, set_color_mesh
from quadpips_drake.visualization.meshes.arrows import command_mesh, push_mesh

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
    pushing: tuple | None = None
    """Which pushes act; None before the first look."""


class WalkVisualizer(LeafSystem):
    """Draws the commanded velocity and the pushes into Meshcat as arrows that go with the robot.

    .. pydrake_system::

        name: WalkVisualizer
        input_ports:
        - robot_state
        - velocity_command

    - robot_state: RobotState, frame W; read at 1 / ``period``.
    - velocity_command: forward, left [m/s], yaw rate [rad/s] in the robot's heading frame, vector (3,).
    """

    def __init__(self, robot, meshcat: Meshcat, pushes: Sequence[Push] = (), *, period: float = 1 / 32, keep_history=True):
        """
        Args:
            robot: the robot.
            meshcat: where to draw.
            pushes: the forces on it.
            period: time between two looks [s].
            keep_history: whether commands that are out of date are hidden (a recording can show them again) or deleted.
        """
        super().__init__()
        self.set_name("walk_visualizer")
        self._meshcat, self._pushes, self._layers = meshcat, tuple(pushes), MeshcatLayers(meshcat, keep_history=keep_history)
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(standing_state(robot)))
        self._command = self.DeclareVectorInputPort("velocity_command", 3)
        self._shown = self.DeclareAbstractState(AbstractValue.Make(_Shown()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._look)
        for k, push in enumerate(self._pushes):
            set_color_mesh(meshcat, f"{ROOT}/pushes/{k}", push_mesh(push.force))

    def _look(self, context, state):
        time, robot = context.get_time(), self._robot_state.Eval(context)
        before = context.get_abstract_state(int(self._shown)).get_value()
        heading = RigidTransform(RollPitchYaw(0, 0, robot.rpy_WB[2]), robot.p_WB + np.array([0, 0, _ABOVE]))
        self._meshcat.SetTransform(f"{ROOT}/command", heading, time)
        command = tuple(np.round(self._command.Eval(context) / _STEP).astype(int).tolist())
        after = dict(vars(before))
        if command != before.command and time - before.time >= _PAUSE - 1e-9:
            self._layers.replace("command", before.number + 1, command_mesh(_STEP * np.array(command)), time)
            after |= {"number": before.number + 1, "command": command, "time": time}
        after["pushing"] = self._draw_pushes(time, robot.p_WB, before.pushing)
        state.get_mutable_abstract_state(int(self._shown)).set_value(_Shown(**after))

    def _draw_pushes(self, time: float, p_WB: np.ndarray, before: tuple | None) -> tuple:
        """Shows what acts, for a quarter of a second at least, or nobody would see it; returns which."""
        pushing = tuple(k for k, p in enumerate(self._pushes) if p.time <= time + 1e-9 < p.time + max(p.duration, 0.25))
        for k in pushing:
            self._meshcat.SetTransform(f"{ROOT}/pushes/{k}", RigidTransform(p_WB), time)
        # A recording has to be told of each at its beginning, else it shows one until it is told otherwise.
        for k in range(len(self._pushes)) if before is None else {*before} ^ {*pushing}:
            self._meshcat.SetProperty(f"{ROOT}/pushes/{k}", "visible", k in pushing, time)
        return pushing
