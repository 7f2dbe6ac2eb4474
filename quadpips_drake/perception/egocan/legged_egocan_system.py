"""The system around the legged egocan."""

from collections.abc import Sequence

import numpy as np

from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.perception.egocan.egocan import (
    EgocanConfig,
    EgocanMemory,
    begin_memory,
    draw_egocan,
    update_memory,
    usable,
)
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import AffordanceImage, EgocanImage
from quadpips_drake.values.regions import GroundHeights
from quadpips_drake.values.robot_state import RobotState


class LeggedEgocan(Stage):
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
        - ground_heights

    - affordance_image: abstract AffordanceImage, sampled at ``config.rate``; one without pixels is skipped.
    - affordance_image_<camera>: the same of each further camera, at the same time.
    - robot_state: abstract RobotState, frame W; its yaw orients the can, its joints tell where the feet stand at the start.
    - egocan: abstract EgocanImage, frame E at the first camera's newest image; NaN where unknown; without content before
      the first image.
    - ground_heights: GroundHeights, frame W: the remembered ground that is trusted, of every steppability.
    """

    WORTH_A_THREAD = True

    def __init__(
        self,
        robot,
        config: EgocanConfig | None = None,
        *,
        further_cameras: Sequence[str] = (),
        timings: StageTimings | None = None,
    ):
        """``further_cameras``: names of those beside the first one, for the names of their ports."""
        config = config or EgocanConfig()
        super().__init__(
            "legged_egocan",
            config,
            memory=EgocanMemory.empty(config),
            label="egocan",
            timings=timings,
            first=FirstUpdate.AT_INITIALIZATION,
        )
        self._robot = robot
        self._image_ports = ["affordance_image", *(f"affordance_image_{camera}" for camera in further_cameras)]
        for name in self._image_ports:
            self.declare_input(name, AffordanceImage)
        self.declare_input("robot_state", RobotState)
        self.declare_output("egocan", EgocanImage, self._draw)
        self.declare_output("ground_heights", GroundHeights, self._heights)

    def initialize(self, inputs: Inputs, memory: EgocanMemory, time: float) -> EgocanMemory:
        """Assumes ground around the feet and takes in the first images."""
        images, state = [getattr(inputs, name) for name in self._image_ports], inputs.robot_state
        if not state.is_known or not usable(images, float(state.rpy_WB[2])):
            return memory  # as if there had been no update: the assumption is for the first images
        X_WB = np.eye(4)
        X_WB[:3, :3], X_WB[:3, 3] = state.R_WB, state.p_WB
        p_WG = self._robot.soles_W(self._robot.foot_positions_W(state))
        return begin_memory(images, float(state.rpy_WB[2]), X_WB, p_WG, self.config)

    def update(self, inputs: Inputs, memory: EgocanMemory, time: float) -> EgocanMemory:
        """Takes in the images of this moment."""
        if self.is_initial(memory):  # there was no estimate of the state, or no image, until now
            return self.initialize(inputs, memory, time)
        images = [getattr(inputs, name) for name in self._image_ports]
        return update_memory(memory, images, float(inputs.robot_state.rpy_WB[2]), self.config)

    def _heights(self, memory: EgocanMemory) -> GroundHeights:
        ground, config = memory.ground, self.config.ground
        return GroundHeights(memory.stamp, ground.first_cell * config.cell, config.cell, ground.trusted_height(config))

    def _draw(self, memory: EgocanMemory) -> EgocanImage:
        with self.timings.measure("egocan_cap"):
            return draw_egocan(memory, self.config)
