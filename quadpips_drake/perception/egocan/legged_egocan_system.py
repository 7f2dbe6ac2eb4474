"""The system around the legged egocan."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import EventStatus, LeafSystem

from quadpips_drake.perception.egocan.egocan import EgocanConfig, EgocanMemory, begin_memory, draw_egocan, update_memory
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import AffordanceImage, EgocanImage
from quadpips_drake.values.robot_state import RobotState


class LeggedEgocan(LeafSystem):
    """Remembers what the camera has seen around the robot, as a cylinder and a floor cap of depth, normals and labels.

    QuadPiPS sections IV-A and V-C, equations 1-4; see egocan.py for where it departs from them. The first update
    assumes flat ground around the feet (section V-D.2), limited and overruled by measurements.

    .. pydrake_system::

        name: LeggedEgocan
        input_ports:
        - affordance_image
        - affordance_image_<camera> (optional)
        - robot_state
        output_ports:
        - egocan

    - affordance_image: abstract AffordanceImage, sampled with ``config.period``; one without pixels is skipped.
    - affordance_image_<camera>: the same of each further camera, at the same time.
    - robot_state: abstract RobotState, frame W; its yaw orients the can, its joints tell where the feet stand at the start.
    - egocan: abstract EgocanImage, frame E at the first camera's newest image; NaN where unknown; without content before
      the first image.
    """

    def __init__(
        self,
        robot,
        config: EgocanConfig | None = None,
        *,
        further_cameras: Sequence[str] = (),
        timings: StageTimings | None = None,
    ):
        """``further_cameras``: names of those beside the first one, for the names of their ports."""
        super().__init__()
        self._robot = robot
        self._config = config or EgocanConfig()
        self._timings = timings or StageTimings()
        names = ["affordance_image", *(f"affordance_image_{camera}" for camera in further_cameras)]
        empty = AbstractValue.Make(AffordanceImage.empty())
        self._image_ports = [self.DeclareAbstractInputPort(name, empty) for name in names]
        self._state_port = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        self._memory = self.DeclareAbstractState(AbstractValue.Make(EgocanMemory.empty(self._config)))
        self.DeclareAbstractOutputPort(
            "egocan",
            lambda: AbstractValue.Make(EgocanImage.empty()),
            self._calc_egocan,
            {self.abstract_state_ticket(self._memory)},
        )
        self.DeclareInitializationUnrestrictedUpdateEvent(self._initialize)
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._config.period, self._config.period, self._update)

    def _initialize(self, context, state):
        images, robot_state = [port.Eval(context) for port in self._image_ports], self._state_port.Eval(context)
        X_WB = np.eye(4)
        X_WB[:3, :3], X_WB[:3, 3] = robot_state.R_WB, robot_state.p_WB
        p_WG = robot_state.p_WB + self._robot.foot_positions_B(robot_state.joint_positions) @ robot_state.R_WB.T
        p_WG[:, 2] -= self._robot.foot_radius
        with self._timings.measure("egocan"):
            memory = begin_memory(images, float(robot_state.rpy_WB[2]), X_WB, p_WG, self._config)
        state.get_mutable_abstract_state(self._memory).set_value(memory)
        return EventStatus.Succeeded()

    def _update(self, context, state):
        images, robot_state = [port.Eval(context) for port in self._image_ports], self._state_port.Eval(context)
        memory = context.get_abstract_state(self._memory).get_value()
        with self._timings.measure("egocan"):
            memory = update_memory(memory, images, float(robot_state.rpy_WB[2]), self._config)
        state.get_mutable_abstract_state(self._memory).set_value(memory)
        return EventStatus.Succeeded()

    def _calc_egocan(self, context, output):
        memory = context.get_abstract_state(self._memory).get_value()
        with self._timings.measure("egocan_cap"):
            output.set_value(draw_egocan(memory, self._config))
