"""The system around the superpixels."""

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.superpixels.superpixels import SuperpixelConfig, segment_superpixels
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import EgocanImage, SuperpixelImage


class SuperpixelSegmenter(Stage):
    """Over-segments the floor cap of the egocan into planar superpixels.

    SLIC for sparse multi-channel images, QuadPiPS section V-D, equations 10-14; see superpixels.py. The superpixels
    of the last update are the abstract state: the next one begins with their clusters and hands their ids on.

    .. pydrake_system::

        name: SuperpixelSegmenter
        input_ports:
        - egocan
        output_ports:
        - superpixels

    - egocan: abstract EgocanImage, frame E.
    - superpixels: abstract SuperpixelImage, frame E, at ``config.rate`` (20 Hz); with rate 0 on demand, each by
      itself without memory. Without clusters while the egocan is empty or nothing in it can be stepped on.
    """

    WORTH_A_THREAD = True

    def __init__(
        self, config: SuperpixelConfig | None = None, *, every_label: bool = False, timings: StageTimings | None = None
    ):
        """``every_label``: whether ground of every label is segmented, not only what is steppable or unknown."""
        config, memory = config or SuperpixelConfig(), SuperpixelImage.empty()
        super().__init__("superpixel_segmenter", config, memory=memory, label="superpixels", timings=timings)
        self._every_label = every_label
        self.declare_input("egocan", EgocanImage)
        self.declare_output("superpixels", SuperpixelImage)

    def update(self, inputs: Inputs, memory: SuperpixelImage, time: float) -> SuperpixelImage:
        """Segments the cap of this moment."""
        previous = memory if self.config.rate > 0 else None
        return segment_superpixels(inputs.egocan, self.config, previous, self._every_label)
