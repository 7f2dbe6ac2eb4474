"""Where planar regions come from: the registry of region sources."""

from dataclasses import dataclass, field
from typing import Any

from quadpips_drake.diagrams.elevation_module import ElevationModule
from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.framework.registry import Registry
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.elevation.elevation_config import ElevationConfig
from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig
from quadpips_drake.perception.regions.oracle_regions_system import OracleRegions
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.sensing import CameraIntrinsics


@dataclass(frozen=True)
class RegionSourceSetup:
    """What a factory of region sources gets."""

    robot: RobotModel
    """With its cameras as they are configured."""
    terrain: Terrain
    """The true world; only oracles look at it."""
    intrinsics: CameraIntrinsics
    """Of all depth images."""
    config: Any
    """Of the entry's configuration type; None if it has none."""
    camera: str = "front"
    """The first camera; its image is ``depth_image``."""
    further_cameras: tuple[str, ...] = ()
    """All others; their images are ``depth_image_<camera>``."""
    seed: int = 0
    timings: StageTimings = field(default_factory=StageTimings)
    every_label: bool = False
    """Whether the planner weighs labels itself and wants regions of every label, not only of ground to step on."""
    images: PerceptionConfig = field(default_factory=PerceptionConfig)
    """Whose depth noise and self-filter all sources by camera let their images go through."""
    with_distance: bool = False
    """Whether somebody wants to know the signed distance from the ground, where the source can tell."""


region_sources = Registry("region source", "quadpips_drake.region_sources")
"""``factory(setup)`` returns a system with the output ``region_set`` (RegionSet, frame W). Its inputs are fed by name: the
estimated ``robot_state`` and any of the station's outputs (``depth_image``, ``depth_image_<camera>``, ``imu``, ...). If
there is an output ``affordance_image`` (AffordanceImage), recordings show its labels; if there is an output
``ground_heights`` (GroundHeights, frame W), swings clear it; if there is an output ``label_image`` (LabelImage), planners
may weigh footholds by it; if there is an output ``signed_distance`` (SignedDistance, frame W), the MPC can keep
knees and trunk off the ground."""


def _superpixels(setup: RegionSourceSetup) -> PerceptionModule:
    return PerceptionModule(
        setup.robot,
        setup.intrinsics,
        setup.config,
        setup.timings,
        camera=setup.camera,
        further_cameras=setup.further_cameras,
        seed=setup.seed,
        every_label=setup.every_label,
    )


def _elevation(setup: RegionSourceSetup) -> ElevationModule:
    return ElevationModule(
        setup.robot,
        setup.intrinsics,
        setup.config,
        setup.timings,
        images=setup.images,
        camera=setup.camera,
        further_cameras=setup.further_cameras,
        seed=setup.seed,
        with_distance=setup.with_distance,
    )


def _oracle(setup: RegionSourceSetup) -> OracleRegions:
    robot, every = setup.robot, setup.every_label
    return OracleRegions(setup.terrain, robot.foot_radius, setup.config, every_label=every, timings=setup.timings)


region_sources.add(
    "superpixels", _superpixels, PerceptionConfig, section="perception", summary="by camera, QuadPiPS section V"
)
region_sources.add(
    "elevation", _elevation, ElevationConfig, summary="by camera, from planes in an elevation map, as rivals have it"
)
region_sources.add(
    "oracle", _oracle, OracleRegionConfig, section="oracle_regions", summary="exact, from the terrain, for finding faults"
)
