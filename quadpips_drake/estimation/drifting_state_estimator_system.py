"""The drifting pose estimate as a system."""

from quadpips_drake.estimation.pose_drift import PoseDriftConfig, drift_state, drifted_world
from quadpips_drake.framework.ports import declare_input, declare_output
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.values.robot_state import RobotState


class DriftingStateEstimator(LeafSystem):
    """Spoils a robot state by a pose that drifts away: X_OB = X_WO(t)^-1 X_WB with X_WO moving at constant rates.

    Everybody who uses its output lives in frame O and takes it for the world; see estimation.pose_drift.

    .. pydrake_system::

        name: DriftingStateEstimator
        input_ports:
        - true_robot_state
        output_ports:
        - robot_state

    - true_robot_state: RobotState without error, frame W.
    - robot_state: the same state in frame O; joints, torques and contacts untouched; continuous.
    """

    def __init__(self, config: PoseDriftConfig, *, seed: int = 0):
        """``seed`` (not negative) chooses the directions of the drift."""
        super().__init__()
        self.set_name("drifting_state_estimator")
        self._config, self._seed = config, seed
        self._state = declare_input(self, "true_robot_state", RobotState)
        declare_output(self, "robot_state", RobotState, self._drift)

    def _drift(self, context) -> RobotState:
        state = self._state.Eval(context)
        return drift_state(state, drifted_world(state.stamp, self._seed, self._config))
