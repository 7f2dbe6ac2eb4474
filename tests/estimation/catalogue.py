"""One instance of every system of this stage, for the test that compares docstrings with ports."""

from pydrake.systems.framework import LeafSystem

from quadpips_drake.estimation.drifting_state_estimator_system import DriftingStateEstimator
from quadpips_drake.estimation.oracle_state_estimator_system import OracleStateEstimator
from quadpips_drake.estimation.pose_drift import PoseDriftConfig
from quadpips_drake.robots.robot_model import load_robot
from quadpips_drake.sensing.contact_sensing import ContactGeometries


def make_systems() -> list[LeafSystem]:
    return [
        OracleStateEstimator(load_robot("anymal_c"), ContactGeometries({}, {})),
        DriftingStateEstimator(PoseDriftConfig()),
    ]
