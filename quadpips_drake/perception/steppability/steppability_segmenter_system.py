"""The system that labels depth images with the steppability network."""

from pathlib import Path

import numpy as np
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.steppability.label_edges import move_borders_to_edges
from quadpips_drake.perception.steppability.model import SteppabilityModel, load_model
from quadpips_drake.perception.steppability.steppability_config import SteppabilityConfig
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.sensing import CameraIntrinsics


class SteppabilitySegmenter(Stage):
    """Labels every pixel of a depth image as steppable, passable or non-passable.

    DeepLabV3+ on depth, QuadPiPS section V-B; see network.py. Borders of what is steppable are moved to where its
    surface ends (label_edges.py). The image is sampled at ``config.rate``, its labels appear ``config.latency``
    later, as from a network that computes beside everything else; until then the last ones, with the time of the image
    they belong to, stay on the output. So nobody waits for the network in simulated time. In wall time it computes in
    between, on the simulation's thread.

    .. pydrake_system::

        name: SteppabilitySegmenter
        input_ports:
        - depth_image
        - robot_state
        output_ports:
        - labels

    - depth_image: ImageDepth32F (height, width) [m] in the optical frame C; 0, NaN and inf are invalid.
    - robot_state: abstract RobotState, frame W, at the time of exposure; its roll and pitch
      give the direction of gravity.
    - labels: abstract LabelImage of the same size, 5 Hz; UNKNOWN where nothing was measured within 3 m; without a pixel
      before the first one and while the image has not the expected size or the pose is not finite. The depth image and
      X_WC come with it.
    """

    WORTH_A_THREAD = True

    def __init__(
        self,
        X_BC: np.ndarray,
        intrinsics: CameraIntrinsics,
        config: SteppabilityConfig | None = None,
        *,
        model: SteppabilityModel | None = None,
        timings: StageTimings | None = None,
        name: str = "steppability_segmenter",
    ):
        """``X_BC``: pose of the optical frame in the base frame, (4, 4). ``model``: by default what ``config`` names."""
        config = config or SteppabilityConfig()
        super().__init__(name, config, memory=LabelImage.empty(), label="steppability", timings=timings)
        self._X_BC = np.array(X_BC, float)
        self._intrinsics = intrinsics
        self._model = model or load_model(Path(config.model) if config.model else None)
        self.declare_input("depth_image", ImageDepth32F, example=ImageDepth32F(intrinsics.width, intrinsics.height))
        self.declare_input("robot_state", RobotState)
        self.declare_output("labels", LabelImage)

    def update(self, inputs: Inputs, memory: LabelImage, time: float) -> LabelImage:
        """Labels the image of this moment."""
        depth, state = np.squeeze(inputs.depth_image.data, axis=2), inputs.robot_state
        X_WB = np.eye(4)
        X_WB[:3, :3], X_WB[:3, 3] = state.R_WB, state.p_WB
        if depth.shape != (self._intrinsics.height, self._intrinsics.width) or not np.isfinite(X_WB).all():
            return LabelImage.empty()
        X_WC = X_WB @ self._X_BC
        labels = self._model.segment(depth, -X_WC[2, :3], self._intrinsics)
        labels = move_borders_to_edges(labels, depth, -X_WC[2, :3], self._intrinsics)
        return LabelImage(state.stamp, labels, np.array(depth), X_WC)
