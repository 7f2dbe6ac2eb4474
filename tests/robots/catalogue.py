"""One instance of every system of this stage."""

from pydrake.systems.framework import LeafSystem

from quadpips_drake.robots.contact_sensing import ContactGeometries
from quadpips_drake.robots.oracle_state_estimator import OracleStateEstimator
from quadpips_drake.robots.push_system import PushSource
from quadpips_drake.robots.robot_model import load_robot


def make_systems() -> list[LeafSystem]:
    return [OracleStateEstimator(load_robot("anymal_c"), ContactGeometries({}, {})), PushSource([], None)]
