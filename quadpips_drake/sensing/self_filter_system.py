"""The self-filter as a system."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.self_filter import SelfFilterConfig, blank_own_body
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.sensing import CameraIntrinsics


class SelfFilter(LeafSystem):
    """Blanks the pixels of a depth image that show the robot itself.

    Each point is held against the shapes of trunk and legs, posed by the measured joint angles; see ``blank_own_body``.

    .. pydrake_system::

        name: SelfFilter
        input_ports:
        - depth_image
        - robot_state
        output_ports:
        - depth_image

    - depth_image (input): ImageDepth32F (width, height) [m], along the optical axis; NaN, 0 or inf where there is none.
    - robot_state: RobotState of the same time; only its joint angles are used.
    - depth_image (output): the same image with NaN where the robot is; all other values untouched. NaN everywhere if the
      input has not the expected size.
    """

    def __init__(
        self,
        robot: RobotModel,
        config: SelfFilterConfig,
        *,
        intrinsics: CameraIntrinsics,
        camera: str = "front",
        timings: StageTimings | None = None,
    ):
        """Args: robot; config; the camera's pinhole parameters and its name among the robot's mounts; stopwatch."""
        LeafSystem.__init__(self)
        self._robot, self._config, self._intrinsics = robot, config, intrinsics
        self._X_BC = robot.camera(camera).X_BC
        self._timings = timings or StageTimings()
        image = ImageDepth32F(intrinsics.width, intrinsics.height)
        self._image = self.DeclareAbstractInputPort("depth_image", AbstractValue.Make(image))
        self._state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        self.DeclareAbstractOutputPort("depth_image", lambda: AbstractValue.Make(image), self._calc_image)

    def _calc_image(self, context, output):
        depth = self._image.Eval(context).data[:, :, 0]
        result = output.get_mutable_value().mutable_data[:, :, 0]
        if depth.shape != result.shape:
            result[:] = np.nan
            return
        np.copyto(result, depth)
        if not self._config.enabled:
            return
        joints = self._state.Eval(context).joint_positions
        with self._timings.measure("self_filter"):
            blank_own_body(result, self._intrinsics, self._X_BC, joints, self._robot, self._config)
