"""The system that labels depth images with the steppability network."""

from pathlib import Path

import numpy as np

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.steppability.label_edges import move_borders_to_edges
from quadpips_drake.perception.steppability.model import SteppabilityModel, load_model
from quadpips_drake.perception.steppability.steppability_config import SteppabilityConfig
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import AffordanceImage, LabelImage
from quadpips_drake.values.sensing import CameraIntrinsics


class SteppabilitySegmenter(Stage):
    """Labels every pixel of a depth image as steppable, passable or non-passable.

    DeepLabV3+ on depth, QuadPiPS section V-B; see network.py. Borders of what is steppable are moved to where its
    surface ends (label_edges.py). The image is sampled at ``config.rate``, its labels appear ``config.latency``
    later, as from a network that computes beside everything else; until then the last ones, with the time of the image
    they belong to, stay on the output. So nobody waits for the network in simulated time. It takes the images that the
    egocan takes in, so that none is rendered for it alone.

    .. pydrake_system::

        name: SteppabilitySegmenter
        input_ports:
        - affordance_image
        output_ports:
        - labels

    - affordance_image: abstract AffordanceImage; its depth is labelled, its pose gives the direction of gravity. Its own
      labels, older ones, are not looked at.
    - labels: abstract LabelImage of the same size, 5 Hz; UNKNOWN where nothing was measured within 3 m; without a pixel
      before the first one and while the image has not the expected size or the pose is not finite. The depth image, X_WC
      and the intrinsics come with it.
    """

    WORTH_A_THREAD = True

    def __init__(
        self,
        intrinsics: CameraIntrinsics,
        config: SteppabilityConfig | None = None,
        *,
        model: SteppabilityModel | None = None,
        timings: StageTimings | None = None,
        name: str = "steppability_segmenter",
    ):
        """``intrinsics``: of the images that are expected. ``model``: by default what ``config`` names."""
        config = config or SteppabilityConfig()
        super().__init__(name, config, memory=LabelImage.empty(), label="steppability", timings=timings)
        self._intrinsics = intrinsics
        self._model = model or load_model(Path(config.model) if config.model else None)
        self.declare_input("affordance_image", AffordanceImage)
        self.declare_output("labels", LabelImage)

    def update(self, inputs: Inputs, memory: LabelImage, time: float) -> LabelImage:
        """Labels the image of this moment."""
        image = inputs.affordance_image
        depth, down_C = image.depth, -image.X_WC[2, :3]
        if depth.shape != (self._intrinsics.height, self._intrinsics.width) or not np.isfinite(image.X_WC).all():
            return LabelImage.empty()
        labels = self._model.segment(depth, down_C, self._intrinsics)
        labels = move_borders_to_edges(labels, depth, down_C, self._intrinsics)
        return LabelImage(image.stamp, labels, depth, image.X_WC, self._intrinsics)
