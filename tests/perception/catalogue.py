"""One instance of every system of the perception."""

from pydrake.systems.framework import LeafSystem

from quadpips_drake.perception.egocan.legged_egocan_system import LeggedEgocan
from quadpips_drake.perception.elevation.elevation_mapper_system import ElevationMapper
from quadpips_drake.perception.elevation.ground_distance_system import GroundDistance
from quadpips_drake.perception.elevation.plane_decomposer_system import PlaneDecomposer
from quadpips_drake.perception.normals.normal_estimator_system import NormalEstimator
from quadpips_drake.perception.regions.oracle_regions_system import OracleRegions
from quadpips_drake.perception.regions.region_extractor_system import RegionExtractor
from quadpips_drake.perception.steppability.steppability_segmenter_system import SteppabilitySegmenter
from quadpips_drake.perception.superpixels.superpixel_segmenter_system import SuperpixelSegmenter
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from tests.perception.scenes import SMALL


def make_systems() -> list[LeafSystem]:
    """Returns an instance of each."""
    robot = load_robot("anymal_c")
    return [
        NormalEstimator(robot.camera().X_BC, SMALL),
        LeggedEgocan(robot),
        SteppabilitySegmenter(SMALL),
        SuperpixelSegmenter(),
        RegionExtractor(robot.foot_radius),
        ElevationMapper(robot, SMALL),
        GroundDistance(),
        PlaneDecomposer(robot.foot_radius),
        OracleRegions(load_terrain("flat"), robot.foot_radius),
    ]
