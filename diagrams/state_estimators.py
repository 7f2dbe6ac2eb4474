"""Who tells where the robot is: the registry of state estimators."""

from dataclasses import dataclass, field
from typing import Any

from pydrake.systems.framework import DiagramBuilder, OutputPort

from quadpips_drake.errors import UserInputError
from quadpips_drake.estimation.drifting_state_estimator_system import DriftingStateEstimator
from quadpips_drake.estimation.oracle_state_estimator_system import OracleStateEstimator
from quadpips_drake.estimation.pose_drift import PoseDriftConfig
from quadpips_drake.framework.ports import connect_by_name, output_of
from quadpips_drake.framework.registry import Registry
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.robot_state import RobotState


@dataclass(frozen=True)
class EstimatorSetup:
    """What a factory of state estimators gets."""

    robot: RobotModel
    config: Any
    """Of the entry's configuration type; None if it has none."""
    seed: int = 0
    timings: StageTimings = field(default_factory=StageTimings)


state_estimators = Registry("state estimator", "quadpips_drake.state_estimators")
"""``factory(setup)`` returns a system with the output ``robot_state`` (RobotState, frame W). Its inputs are fed by name: any
of the station's outputs (``joint_encoders``, ``imu``, ``foot_contacts``, ``joint_torques``, ``depth_image``, ...), and
``true_robot_state`` for those that spoil the truth."""


def _oracle(setup: EstimatorSetup) -> OracleStateEstimator:
    return OracleStateEstimator()


def _drifting(setup: EstimatorSetup) -> DriftingStateEstimator:
    return DriftingStateEstimator(setup.config, seed=setup.seed)


state_estimators.add("oracle", _oracle, summary="the simulated state, without error")
state_estimators.add(
    "drifting", _drifting, PoseDriftConfig, section="drift", summary="the truth in a frame that drifts away"
)


def check_drift(state_estimator: str, drift: PoseDriftConfig) -> None:
    """Refuses a drift that nobody would make (UserInputError)."""
    if drift.enabled and state_estimator == "oracle":
        raise UserInputError("there is a drift to make, but state_estimator is oracle; set state_estimator=drifting")


def add_state_estimate(
    builder: DiagramBuilder, name: str, setup: EstimatorSetup, sensors: dict[str, OutputPort]
) -> tuple[OutputPort, OutputPort]:
    """Adds the estimator called ``name``; returns the ports of the robot's true state and of the estimate.

    Args:
        builder: of the whole diagram.
        name: of the estimator, in the registry.
        setup: what its factory gets.
        sensors: the station's outputs by name.
    """
    oracle = builder.AddSystem(OracleStateEstimator())
    connect_by_name(builder, oracle, sensors)
    truth = oracle.GetOutputPort("robot_state")
    if name == "oracle":
        return truth, truth
    estimator = builder.AddSystem(state_estimators.get(name).factory(setup))
    connect_by_name(builder, estimator, {**sensors, "true_robot_state": truth})
    return truth, output_of(estimator, "robot_state", RobotState)
