"""What the sources of regions have in common."""

import dataclasses

import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.elevation.elevation_config import PlaneConfig
from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig
from quadpips_drake.perception.regions.region_extraction import RegionConfig
from quadpips_drake.perception.regions.region_source_config import RegionSourceConfig


@pytest.mark.parametrize("config", [RegionConfig, OracleRegionConfig, PlaneConfig])
def test_how_far_feet_stay_from_edges_stands_once(config):
    shared = {field.name for field in dataclasses.fields(RegionSourceConfig)} - {"rate", "latency"}
    assert shared == {"margin", "min_radius"}
    assert issubclass(config, RegionSourceConfig)
    assert not shared & set(vars(config)["__annotations__"])


@pytest.mark.parametrize("config", [RegionConfig, OracleRegionConfig, PlaneConfig])
def test_a_negative_margin_is_refused(config):
    with pytest.raises(UserInputError, match="margin"):
        config(margin=-0.01)
