"""The system around the superpixels."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.perception.periodic_stage import declare_periodic_output
from quadpips_drake.perception.superpixels.superpixels import SuperpixelConfig, segment_superpixels
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import EgocanImage, SuperpixelImage


class SuperpixelSegmenter(LeafSystem):
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
    - superpixels: abstract SuperpixelImage, frame E, every ``config.period`` (20 Hz); with period 0 on demand, each by
      itself without memory. Without clusters while the egocan is empty or nothing in it can be stepped on.
    """

    def __init__(self, config: SuperpixelConfig | None = None, *, timings: StageTimings | None = None):
        super().__init__()
        self._config = config or SuperpixelConfig()
        self._timings = timings or StageTimings()
        self._can_port = self.DeclareAbstractInputPort("egocan", AbstractValue.Make(EgocanImage.empty()))
        declare_periodic_output(
            self, "superpixels", SuperpixelImage.empty(), self._segment, [self._can_port], self._config.period
        )

    def _segment(self, context) -> SuperpixelImage:
        can = self._can_port.Eval(context)
        previous = context.get_abstract_state(0).get_value() if self._config.period > 0 else None
        with self._timings.measure("superpixels"):
            return segment_superpixels(can, self._config, previous)
