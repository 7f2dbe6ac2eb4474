"""CameraFollower: Meshcat's camera goes with the robot."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat

from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.visualization.meshcat_layers import look_at_robot


class CameraFollower(LeafSystem):
    """Moves Meshcat's camera when the robot has gone some way, so that a long walk does not leave the picture.

    It moves in leaps: in between the user may turn the view with the mouse. (Meshcat ignores a transform of /Cameras/default
    once the camera has a target.)

    .. pydrake_system::

        name: CameraFollower
        input_ports:
        - robot_state

    - robot_state: RobotState, frame W; read at 1 / ``period``.
    """

    def __init__(self, robot, meshcat: Meshcat, *, leap: float = 1.2, period: float = 0.1):
        """Args: the robot; where it is drawn; how far it goes before the camera follows [m]; time between looks [s]."""
        super().__init__()
        self.set_name("camera_follower")
        self._meshcat, self._leap = meshcat, leap
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(standing_state(robot)))
        self.DeclareDiscreteState(np.full(2, np.inf))  # what the camera looks at, x, y in W [m]
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._follow)

    def _follow(self, context, state):
        robot = self._robot_state.Eval(context).p_WB[:2]
        target = context.get_discrete_state_vector().value()
        if not np.linalg.norm(robot - target) < self._leap:
            look_at_robot(self._meshcat, robot)
            state.get_mutable_vector().SetFromVector(robot)
