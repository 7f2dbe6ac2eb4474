"""Instances of every Diagram, for the test that compares docstrings with ports."""

from pydrake.systems.framework import Diagram

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.diagrams.elevation_module import ElevationModule
from quadpips_drake.diagrams.observed_station import ObservedStation
from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.diagrams.planning_module import PlanningConfig, PlanningModule
from quadpips_drake.diagrams.quadpips import QuadpipsConfig, QuadpipsDiagram
from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.diagrams.tracking_module import TrackingModule
from quadpips_drake.diagrams.walk import WalkDiagram
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain


def make_systems() -> list[Diagram]:
    """Returns an instance of each, and others of those whose ports depend on the configuration."""
    robot, terrain = load_robot("anymal_c"), load_terrain("flat")
    station = SimulationStation(robot, terrain, StationConfig(further_cameras=["left", "right"]))
    intrinsics = station.camera_intrinsics
    return [
        station,
        ObservedStation(robot, terrain),
        PerceptionModule(robot, intrinsics),
        PerceptionModule(robot, intrinsics, QuadpipsConfig().perception),
        PerceptionModule(robot, intrinsics, further_cameras=["left", "right"]),
        ElevationModule(robot, intrinsics, further_cameras=["left", "right"]),
        ElevationModule(robot, intrinsics, with_distance=True),
        PlanningModule(robot),
        PlanningModule(robot, PlanningConfig(footholds=FootholdConfig(steppability="penalty"))),
        TrackingModule(robot),
        WalkDiagram(robot, terrain, [WalkCommand()]),
        QuadpipsDiagram(robot, terrain),
    ]
