"""All registries in one place: what can be swapped, by name."""

from quadpips_drake.diagrams.planners import planners
from quadpips_drake.diagrams.region_sources import region_sources
from quadpips_drake.diagrams.state_estimators import state_estimators
from quadpips_drake.gaits.gaits import gaits
from quadpips_drake.robots.robot_library import robots
from quadpips_drake.solvers.registry import qp_solvers
from quadpips_drake.terrain.library import terrains

__all__ = ["gaits", "planners", "qp_solvers", "region_sources", "robots", "state_estimators", "terrains"]
