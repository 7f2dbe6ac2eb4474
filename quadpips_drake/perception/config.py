"""The configuration of the whole perception."""

from dataclasses import dataclass, field

from quadpips_drake.perception.egocan import EgocanConfig
from quadpips_drake.perception.normals import NormalConfig
from quadpips_drake.perception.region_extraction import RegionConfig
from quadpips_drake.perception.superpixels import SuperpixelConfig


@dataclass
class PerceptionConfig:
    """From the depth image to the regions, stage by stage."""

    normals: NormalConfig = field(default_factory=NormalConfig)
    egocan: EgocanConfig = field(default_factory=EgocanConfig)
    superpixels: SuperpixelConfig = field(default_factory=SuperpixelConfig)
    regions: RegionConfig = field(default_factory=RegionConfig)
