"""Configuration of the steppability segmentation."""

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.stage_config import StageConfig, stage_rate


@configuration
class SteppabilityConfig(StageConfig):
    """Whether and how often depth images are labelled by the network."""

    rate: float = stage_rate(5.0)
    """How often an image is labelled [Hz] (QuadPiPS: 5); in between, points keep the labels they have."""
    latency: float = ranged(0.05, 0.0, 10.0)
    """How much later than their image labels appear [s], in simulated time."""
    enabled: bool = False
    """Whether the network runs; without it all ground is of unknown steppability and judged by its geometry."""
    model: str = ""
    """Directory of a model that 'quadpips train' has written; empty: the one that comes with the package."""
