"""The system around the normal estimation."""

from dataclasses import replace

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.perception.normals.label_transfer import transfer_labels
from quadpips_drake.perception.normals.normals import NormalConfig, clean_depth, estimate_normals
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.camera_intrinsics import CameraIntrinsics
from quadpips_drake.values.images import AffordanceImage, LabelImage
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.steppability import Steppability


class NormalEstimator(LeafSystem):
    """Estimates a surface normal per pixel and assembles the affordance image (depth, normal, steppability).

    Image gradients, QuadPiPS section V-A, equations 5-9; see normals.py. The pose of the camera follows from the
    state of the base: X_WC = X_WB X_BC. Without memory: whoever reads the output sets the rate (30 Hz in the paper).

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

    def __init__(
        self,
        X_BC: np.ndarray,
        intrinsics: CameraIntrinsics,
        config: NormalConfig | None = None,
        *,
        timings: StageTimings | None = None,
    ):
        """``X_BC``: pose of the optical frame in the base frame, (4, 4)."""
        super().__init__()
        self._X_BC = np.array(X_BC, float)
        self._intrinsics = intrinsics
        self._config = config or NormalConfig()
        self._timings = timings or StageTimings()
        depth = AbstractValue.Make(ImageDepth32F(intrinsics.width, intrinsics.height))
        self._depth_port = self.DeclareAbstractInputPort("depth_image", depth)
        self._state_port = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        self._label_port = self.DeclareAbstractInputPort("labels", AbstractValue.Make(LabelImage.empty()))
        self.DeclareAbstractOutputPort(
            "affordance_image",
            lambda: AbstractValue.Make(AffordanceImage.empty()),
            self._calc_affordance_image,
            {self._depth_port.ticket(), self._state_port.ticket(), self._label_port.ticket()},
        )

    def _calc_affordance_image(self, context, output):
        depth = np.squeeze(self._depth_port.Eval(context).data, axis=2)
        labels = self._label_port.Eval(context) if self._label_port.HasValue(context) else None
        with self._timings.measure("normals"):
            image = make_affordance_image(
                depth, self._state_port.Eval(context), self._X_BC, self._intrinsics, self._config, labels
            )
        output.set_value(image)


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
    cleaned = clean_depth(depth, config)
    if labelled is None:
        labels = np.full(shape, Steppability.UNKNOWN, np.uint8)
    else:
        labels = transfer_labels(cleaned, X_WC, intrinsics, labelled)
    with np.errstate(invalid="ignore"):
        surface = np.where(depth > config.max_range, np.float32(np.inf), cleaned)
    return AffordanceImage(state.stamp, X_WC, intrinsics, surface, estimate_normals(depth, intrinsics, config), labels)
