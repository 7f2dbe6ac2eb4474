"""One instance of every system of this stage, for the test that compares docstrings with ports."""

from pydrake.systems.framework import LeafSystem

from quadpips_drake.estimation.drifting_state_estimator_system import DriftingStateEstimator
from quadpips_drake.estimation.oracle_state_estimator_system import OracleStateEstimator
from quadpips_drake.estimation.pose_drift import PoseDriftConfig


def make_systems() -> list[LeafSystem]:
    return [
        OracleStateEstimator(),
        DriftingStateEstimator(PoseDriftConfig()),
    ]
