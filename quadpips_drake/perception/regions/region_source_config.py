"""What all sources of planar regions agree on: how far feet stay from edges."""

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.stage_config import OnDemandStageConfig


@configuration
class RegionSourceConfig(OnDemandStageConfig):
    """Where in a region a foot may stand; the configuration of each source begins with it."""

    margin: float = ranged(0.015, 0.0, 0.2)
    """A foot sphere stays at least this far from every edge, beside its radius [m]."""
    min_radius: float = ranged(0.015, 0.0, 1.0)
    """Least radius around the centre of an inset, where a foot's centre may go [m]."""
