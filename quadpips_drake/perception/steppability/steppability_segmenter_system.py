"""The system that labels depth images with the steppability network."""

from pathlib import Path

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import EventStatus, LeafSystem
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.perception.periodic_stage import declare_periodic_output
from quadpips_drake.perception.steppability.label_edges import move_borders_to_edges
from quadpips_drake.perception.steppability.model import SteppabilityModel, load_model
from quadpips_drake.perception.steppability.steppability_config import SteppabilityConfig
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.camera_intrinsics import CameraIntrinsics
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.robot_state import RobotState


class SteppabilitySegmenter(LeafSystem):
    """Labels every pixel of a depth image as steppable, passable or non-passable.

    DeepLabV3+ on depth, QuadPiPS section V-B; see network.py. Borders of what is steppable are moved to where its
    surface ends (label_edges.py). The image is sampled with ``config.period``, its labels appear ``config.latency``
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

    def __init__(
        self,
        X_BC: np.ndarray,
        intrinsics: CameraIntrinsics,
        config: SteppabilityConfig | None = None,
        *,
        model: SteppabilityModel | None = None,
        timings: StageTimings | None = None,
    ):
        """``X_BC``: pose of the optical frame in the base frame, (4, 4). ``model``: by default what ``config`` names."""
        super().__init__()
        config = config or SteppabilityConfig()
        self._X_BC = np.array(X_BC, float)
        self._intrinsics = intrinsics
        self._model = model or load_model(Path(config.model) if config.model else None)
        self._timings = timings or StageTimings()
        depth = AbstractValue.Make(ImageDepth32F(intrinsics.width, intrinsics.height))
        self._depth_port = self.DeclareAbstractInputPort("depth_image", depth)
        self._state_port = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        inputs = [self._depth_port, self._state_port]
        if config.latency > 0:
            self._declare_late_output(config)
        else:
            declare_periodic_output(self, "labels", LabelImage.empty(), self._segment, inputs, config.period)

    def _declare_late_output(self, config: SteppabilityConfig) -> None:
        """Declares the output "labels", on which a value appears ``config.latency`` after it was computed."""
        computed, shown = (self.DeclareAbstractState(AbstractValue.Make(LabelImage.empty())) for _ in range(2))

        def compute(context, state):
            state.get_mutable_abstract_state(int(computed)).set_value(self._segment(context))
            return EventStatus.Succeeded()

        def show(context, state):
            value = context.get_abstract_state(int(computed)).get_value()
            state.get_mutable_abstract_state(int(shown)).set_value(value)
            return EventStatus.Succeeded()

        self.DeclarePeriodicUnrestrictedUpdateEvent(config.period, 0.0, compute)
        self.DeclarePeriodicUnrestrictedUpdateEvent(config.period, config.latency, show)
        self.DeclareStateOutputPort("labels", shown)

    def _segment(self, context) -> LabelImage:
        depth = np.squeeze(self._depth_port.Eval(context).data, axis=2)
        state = self._state_port.Eval(context)
        with self._timings.measure("steppability"):
            X_WB = np.eye(4)
            X_WB[:3, :3], X_WB[:3, 3] = state.R_WB, state.p_WB
            if depth.shape != (self._intrinsics.height, self._intrinsics.width) or not np.isfinite(X_WB).all():
                return LabelImage.empty()
            X_WC = X_WB @ self._X_BC
            labels = self._model.segment(depth, -X_WC[2, :3], self._intrinsics)
            labels = move_borders_to_edges(labels, depth, -X_WC[2, :3], self._intrinsics)
            return LabelImage(state.stamp, labels, np.array(depth), X_WC)
