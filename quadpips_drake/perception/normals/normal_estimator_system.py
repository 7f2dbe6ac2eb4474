"""The system around the normal estimation."""

from dataclasses import replace

import numpy as np
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.normals.label_transfer import transfer_labels
from quadpips_drake.perception.normals.normals import NormalConfig, measure_surface
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import AffordanceImage, LabelImage
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.sensing import CameraIntrinsics
from quadpips_drake.values.steppability import Steppability


class NormalEstimator(Stage):
    """Estimates a surface normal per pixel and assembles the affordance image (depth, normal, steppability).

    Image gradients, QuadPiPS section V-A, equations 5-9; see normals.py. The pose of the camera follows from the
    state of the base: X_WC = X_WB X_BC. Unless it has a rate of its own, whoever reads the output
    sets it (30 Hz in the paper).

    .. pydrake_system::

        name: NormalEstimator
        input_ports:
        - depth_image
        - robot_state
        - labels (optional)
        output_ports:
        - affordance_image

    - depth_image: ImageDepth32F (height, width) [m] in the optical frame C; 0, NaN and inf are invalid. +inf means that the
      nearest surface is out of range.
    - robot_state: abstract RobotState, frame W, at the time of exposure.
    - labels: abstract LabelImage of the same size, at this time or before; its labels follow the points into this image.
      Any other size, or none at all, makes every pixel UNKNOWN.
    - affordance_image: abstract AffordanceImage in C; NaN where invalid, +inf kept in the depth where nothing is in range;
      without a pixel when the image has not the expected size; without time, too, when the pose is not finite.
    """

    WORTH_A_THREAD = True

    def __init__(
        self,
        X_BC: np.ndarray,
        intrinsics: CameraIntrinsics,
        config: NormalConfig | None = None,
        *,
        timings: StageTimings | None = None,
        name: str = "normal_estimator",
    ):
        """``X_BC``: pose of the optical frame in the base frame, (4, 4)."""
        super().__init__(name, config or NormalConfig(), memory=AffordanceImage.empty(), label="normals", timings=timings)
        self._X_BC = np.array(X_BC, float)
        self._intrinsics = intrinsics
        self.declare_input("depth_image", ImageDepth32F, example=ImageDepth32F(intrinsics.width, intrinsics.height))
        self.declare_input("robot_state", RobotState)
        self.declare_input("labels", LabelImage, default=None)
        self.declare_output("affordance_image", AffordanceImage)

    def update(self, inputs: Inputs, memory: AffordanceImage, time: float) -> AffordanceImage:
        """Estimates the normals of the image of this moment."""
        depth = np.squeeze(inputs.depth_image.data, axis=2)
        state, labels = inputs.robot_state, inputs.labels
        return make_affordance_image(depth, state, self._X_BC, self._intrinsics, self.config, labels)


def make_affordance_image(
    depth: np.ndarray,
    state: RobotState,
    X_BC: np.ndarray,
    intrinsics: CameraIntrinsics,
    config: NormalConfig,
    labelled: LabelImage | None = None,
) -> AffordanceImage:
    """Returns the affordance image of one ``depth`` image [m], (height, width), taken in robot ``state``.

    ``labelled``: labels of this image or of an older one of the same camera; see perception.normals.label_transfer.
    Depth +inf ("further than the sensor's range") stays in the image: it is evidence of free space.
    """
    X_WB = np.eye(4)
    X_WB[:3, :3] = state.R_WB
    X_WB[:3, 3] = state.p_WB
    shape = (intrinsics.height, intrinsics.width)
    if not (np.all(np.isfinite(X_WB)) and np.isfinite(state.stamp)):
        return AffordanceImage.empty()
    X_WC = X_WB @ X_BC
    if depth.shape != shape:
        return replace(AffordanceImage.empty(), stamp=state.stamp, X_WC=X_WC)
    surface, normals = measure_surface(depth, intrinsics, config)
    if labelled is None:
        labels = np.full(shape, Steppability.UNKNOWN, np.uint8)
    else:
        labels = transfer_labels(surface, X_WC, intrinsics, labelled)
    return AffordanceImage(state.stamp, X_WC, intrinsics, surface, normals, labels)
