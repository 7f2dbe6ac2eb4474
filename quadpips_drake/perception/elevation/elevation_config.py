"""The configuration of the region source ``elevation``."""

import dataclasses
from dataclasses import field
from typing import Any

from quadpips_drake.configuration.schema import MAX_SEED, configuration, ranged
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.perception.assumed_ground import AssumedGroundConfig
from quadpips_drake.perception.regions.region_source_config import RegionSourceConfig

FINE, PAPER = "fine", "paper"
PRESETS: dict[str, dict[str, float]] = {
    FINE: {"cell": 0.03, "layer": 0.03, "clean_up_period": 0.0, "resample": 0.0, "max_filled": 0.04},
    PAPER: {"cell": 0.06, "layer": 0.06, "clean_up_period": 1.0, "resample": 0.04, "max_filled": 3.0},
}
"""What keys that are null stand for: the finest map that repays its time, and the one of QuadPiPS' rivals."""


@configuration
class ElevationMapConfig(StageConfig, AssumedGroundConfig):
    """How depth images become heights."""

    rate: float = stage_rate(30.0)
    """How often an image is taken in [Hz]."""
    half_extent: float = ranged(1.5, 0.1, 10.0)
    """The map reaches this far from the base in x and y of the world [m]."""
    cell: float | None = ranged(None, 0.01, 0.5)
    """Side of a cell [m]; null: the preset's."""
    layer: float | None = ranged(None, 0.001, 1.0)
    """Of the points of one image in one cell, those within this of the highest are its surface [m]; null: the preset's."""
    nearest: float = ranged(0.01, 0.0, 10.0)
    """Depths below this are not used [m]."""
    farthest: float = ranged(4.0, 0.1, 100.0)
    """Depths above this are not used [m]."""
    depth_sigma: float = ranged(0.001, 0.0, 1.0)
    """Standard deviation that a depth is taken to have at zero depth [m]."""
    depth_sigma_growth: float = ranged(0.004, 0.0, 1.0)
    """What it grows by with the squared depth [1/m]."""
    min_variance: float = ranged(1e-4, 1e-8, 1.0)
    """Least variance of a height, a measured one as well as a fused one [m^2]."""
    max_variance: float = ranged(0.05, 1e-8, 100.0)
    """A height whose variance has grown to this is replaced by the next one [m^2]."""
    gate: float = ranged(2.5, 0.1, 100.0)
    """Heights that are further apart than this many standard deviations (Mahalanobis) are not fused [1]."""
    multi_height_variance: float = ranged(0.001, 0.0, 100.0)
    """What the variance of a cell grows by with each height that is not fused [m^2]."""
    clean_up_period: float | None = ranged(None, 0.0, 100.0)
    """How often cells that the camera sees through are removed [s], 0: with each image; null: the preset's."""
    see_through: float = ranged(0.04, 0.001, 1.0)
    """The camera sees through a cell when it sees this much further [m]."""
    max_jump: float = ranged(0.5, 0.001, 100.0)
    """The map is dropped when the base moves further than this between two images [m]."""
    max_turn: float = ranged(0.7, 0.001, 4.0)
    """The map is dropped when the base yaws further than this between two images [rad]."""

    def __post_init__(self):
        super().__post_init__()
        if self.cell is not None and not 10 * self.cell <= self.half_extent <= 200 * self.cell:
            raise UserInputError(f"half_extent must be 10 to 200 cells of {self.cell:g} m, not {self.half_extent:g} m")

    @property
    def cells(self) -> int:
        """Cells along one side of the map."""
        return 2 * round(self.half_extent / self.cell)


@configuration
class PlaneConfig(RegionSourceConfig):
    """How an elevation map is taken apart into planar convex regions."""

    rate: float = stage_rate(20.0, on_demand=True)
    """How often the map is taken apart [Hz]; 0: whenever the regions are read, and then they keep no ids."""
    resample: float | None = ranged(None, 0.01, 0.5, zero=True)
    """Side of the cells that the map is resampled to [m], 0: its own; null: the preset's."""
    max_filled: float | None = ranged(None, 0.0, 100.0)
    """Holes in what was seen that are up to this wide are ground, as high as their lowest border [m]; null: the preset's.
    Wider ones are filled for the filters only."""
    max_roughness: float = ranged(0.02, 1e-4, 1.0)
    """Root mean square of the heights off the plane of 3 x 3 cells, above which a cell is not planar [m]."""
    max_steepness: float = ranged(0.6109, 0.01, 1.5)
    """... and the slope of that plane [rad] (35 deg)."""
    min_cells: int = ranged(4, 1, 10_000)
    """A component, or a plane, of fewer cells is dropped."""
    max_off_plane: float = ranged(0.025, 0.001, 1.0)
    """A component is split by RANSAC if a cell is further off its plane than this [m] ..."""
    max_off_normal: float = ranged(0.4363, 0.01, 1.5)
    """... or turned against it by more than this [rad] (25 deg)."""
    max_slope: float = ranged(0.5236, 0.01, 1.5)
    """Steeper planes are no regions [rad] (30 deg)."""
    max_tries: int = ranged(60, 1, 10_000)
    """Most planes that RANSAC tries for each plane that it finds."""
    miss: float = ranged(0.01, 1e-6, 0.5)
    """Chance of missing the best plane at which no further ones are tried [1]."""
    seed: int = ranged(0, 0, MAX_SEED)
    """Of the planes that RANSAC tries."""
    upsample: int = ranged(3, 1, 10)
    """Pixels along a side of a cell, in which contours are drawn."""
    piece: float = ranged(0.2, 0.05, 10.0)
    """Wanted side of a region's inset [m]; larger ones are cut."""
    overlap: float = ranged(0.02, 0.0, 0.2)
    """Insets of one plane reach this far into each other where they were cut [m]."""


@configuration
class DistanceConfig(StageConfig):
    """The signed distance from the ground, worked out if the MPC keeps bodies off it (``ocp.sdf_clearance``)."""

    rate: float = stage_rate(5.0)
    """How often it is worked out [Hz]."""
    half_extent: float = ranged(0.9, 0.1, 10.0)
    """It reaches this far from the base in x and y of the world [m] ..."""
    below: float = ranged(0.8, 0.1, 10.0)
    """... and at most this far down from it [m]."""


@configuration
class ElevationConfig:
    """From the depth image by way of an elevation map to the regions; noise and self-filter are those of ``perception``."""

    preset: str = FINE
    """What keys that are null stand for: fine (3 cm cells), or paper (6 cm, as the baselines of QuadPiPS had it)."""
    map: ElevationMapConfig = field(default_factory=ElevationMapConfig)
    planes: PlaneConfig = field(default_factory=PlaneConfig)
    distance: DistanceConfig = field(default_factory=DistanceConfig)

    def __post_init__(self):
        if self.preset not in PRESETS:
            raise unknown_name("preset", self.preset, PRESETS)
        self.filled()

    def filled(self) -> "ElevationConfig":
        """Returns the same without null."""
        return (
            dataclasses.replace(self, map=with_preset(self.map, self.preset), planes=with_preset(self.planes, self.preset))
            if self.has_null
            else self
        )

    @property
    def has_null(self) -> bool:
        """Whether anything is left to the preset."""
        return any(value is None for section in (self.map, self.planes) for value in vars(section).values())


def with_preset(config: Any, preset: str = FINE) -> Any:
    """Returns ``config`` (of the map or of the planes) with the preset's values where it has null."""
    values = PRESETS[preset]
    return dataclasses.replace(config, **{name: values[name] for name, value in vars(config).items() if value is None})
