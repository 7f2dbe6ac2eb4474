"""The configuration of the whole perception."""

from dataclasses import field

from quadpips_drake.configuration.schema import configuration
from quadpips_drake.perception.egocan.egocan import EgocanConfig
from quadpips_drake.perception.normals.normals import NormalConfig
from quadpips_drake.perception.regions.region_extraction import RegionConfig
from quadpips_drake.perception.steppability.steppability_config import SteppabilityConfig
from quadpips_drake.perception.superpixels.superpixels import SuperpixelConfig
from quadpips_drake.sensing.depth_noise import DepthNoiseConfig
from quadpips_drake.sensing.self_filter import SelfFilterConfig


@configuration
class PerceptionConfig:
    """From the depth image to the regions, stage by stage."""

    depth_noise: DepthNoiseConfig = field(default_factory=DepthNoiseConfig)
    self_filter: SelfFilterConfig = field(default_factory=SelfFilterConfig)
    normals: NormalConfig = field(default_factory=NormalConfig)
    steppability: SteppabilityConfig = field(default_factory=SteppabilityConfig)
    egocan: EgocanConfig = field(default_factory=EgocanConfig)
    superpixels: SuperpixelConfig = field(default_factory=SuperpixelConfig)
    regions: RegionConfig = field(default_factory=RegionConfig)


def steppable_perception() -> PerceptionConfig:
    """Perception with the steppability network, as in whole runs; by itself the module judges ground by its geometry."""
    return PerceptionConfig(steppability=SteppabilityConfig(enabled=True))
