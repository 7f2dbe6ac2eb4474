"""PushVisualizer: pushes as arrows at the robot, in Meshcat and in recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform

from quadpips_drake.faults.push_system import Push
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.visualization.meshcat_layers import ROOT, set_color_mesh
from quadpips_drake.visualization.meshes.arrows import push_mesh

SHORTEST = 0.25
"""A push is shown for so long at least, or nobody would see it [s]."""


@dataclass(frozen=True)
class _Shown(ImmutableValue):
    """What is on show."""

    pushing: tuple | None = None
    """Which pushes act; None before the first look."""


class PushVisualizer(LeafSystem):
    """Draws the pushes into Meshcat as arrows that go with the robot and end where the force acts.

    .. pydrake_system::

        name: PushVisualizer
        input_ports:
        - robot_state

    - robot_state: RobotState, the true one, frame W; read at 1 / ``period``.
    """

    def __init__(self, robot, meshcat: Meshcat, pushes: Sequence[Push], *, period: float = 1 / 32):
        """
        Args:
            robot: the robot.
            meshcat: where to draw.
            pushes: the forces on it.
            period: time between two looks [s].
        """
        super().__init__()
        self.set_name("push_visualizer")
        self._meshcat, self._pushes = meshcat, tuple(pushes)
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(standing_state(robot)))
        self._shown = self.DeclareAbstractState(AbstractValue.Make(_Shown()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._look)
        for k, push in enumerate(self._pushes):
            set_color_mesh(meshcat, f"{ROOT}/pushes/{k}", push_mesh(push.force))

    def _look(self, context, state):
        time, robot = context.get_time(), self._robot_state.Eval(context)
        before = context.get_abstract_state(int(self._shown)).get_value().pushing
        pushing = tuple(k for k, p in enumerate(self._pushes) if p.time <= time + 1e-9 < p.time + max(p.duration, SHORTEST))
        for k in pushing:
            self._meshcat.SetTransform(f"{ROOT}/pushes/{k}", RigidTransform(robot.p_WB), time)
        # A recording has to be told of each at its beginning, else it shows one until it is told otherwise.
        for k in range(len(self._pushes)) if before is None else {*before} ^ {*pushing}:
            self._meshcat.SetProperty(f"{ROOT}/pushes/{k}", "visible", k in pushing, time)
        state.get_mutable_abstract_state(int(self._shown)).set_value(_Shown(pushing))
