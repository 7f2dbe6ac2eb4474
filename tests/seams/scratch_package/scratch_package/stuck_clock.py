"""A state estimator without settings: the truth as it was at the last tick of a slow clock."""

import quadpips_drake as qp


class StuckClock(qp.Stage):
    """Samples the true state at 400 Hz, from what the station's sensors and the oracle offer."""

    def __init__(self, setup: qp.EstimatorSetup):
        super().__init__("stuck_clock", qp.StageConfig(rate=400.0), memory=qp.RobotState.empty(), timings=setup.timings)
        self.declare_input("true_robot_state", qp.RobotState)
        self.declare_vector_input("imu", 6)
        self.declare_input("foot_contacts", qp.FootContacts)
        self.declare_output("robot_state", qp.RobotState)

    def initialize(self, inputs, memory, time):
        """The first sample."""
        return inputs.true_robot_state

    def update(self, inputs, memory: qp.RobotState, time: float) -> qp.RobotState:
        """One more."""
        return inputs.true_robot_state


ENTRY = StuckClock
