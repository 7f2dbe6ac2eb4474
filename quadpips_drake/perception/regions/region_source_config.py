"""What all sources of planar regions agree on: how far feet stay from edges."""

from dataclasses import dataclass

from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import OnDemandStageConfig


@dataclass
class RegionSourceConfig(OnDemandStageConfig):
    """Where in a region a foot may stand; the configuration of each source begins with it."""

    margin: float = 0.015
    """A foot sphere stays at least this far from every edge, beside its radius [m]."""
    min_radius: float = 0.015
    """Least radius around the centre of an inset, where a foot's centre may go [m]."""

    def __post_init__(self):
        super().__post_init__()
        if min(self.margin, self.min_radius) < 0:
            raise UserInputError("regions: margin and min_radius must not be negative")
