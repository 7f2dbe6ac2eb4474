"""One instance of every system of this stage."""

from pydrake.systems.framework import LeafSystem

from quadpips_drake.estimation.oracle_state_estimator_system import OracleStateEstimator
from quadpips_drake.faults.push_system import PushSource
from quadpips_drake.robots.robot_model import load_robot
from quadpips_drake.sensing.contact_sensing import ContactGeometries


def make_systems() -> list[LeafSystem]:
    return [OracleStateEstimator(load_robot("anymal_c"), ContactGeometries({}, {})), PushSource([], None)]
