"""The tracking module: from the robot's state and a whole-body reference to torques."""

from dataclasses import dataclass, field

from pydrake.systems.framework import Diagram, DiagramBuilder

from quadpips_drake.control.mpc.centroidal_mpc_system import CentroidalMpc
from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.control.whole_body.whole_body_controller_system import WholeBodyController
from quadpips_drake.errors import UserInputError
from quadpips_drake.supervision.safety import SafetyConfig
from quadpips_drake.supervision.safety_monitor_system import SafetyMonitor


@dataclass
class TrackingConfig:
    """Safety monitor, model predictive and whole-body control."""

    mpc_rate: float = 50.0
    """[Hz] (QuadPiPS: 50)"""
    wbc_rate: float = 500.0
    """[Hz] (QuadPiPS: 500 to 1000)"""
    safety_rate: float = 100.0
    """[Hz]"""
    safety: SafetyConfig = field(default_factory=SafetyConfig)
    mpc: MpcConfig = field(default_factory=MpcConfig)
    wbc: WbcConfig = field(default_factory=WbcConfig)

    def __post_init__(self):
        if not 0.0 < self.mpc_rate <= self.wbc_rate:
            raise UserInputError("tracking needs 0 < mpc_rate <= wbc_rate")
        if not 0.0 < self.safety_rate <= 1000.0:
            raise UserInputError(f"tracking.safety_rate must be between 0 and 1000 Hz, is {self.safety_rate}")


class TrackingModule(Diagram):
    """Model predictive control (CentroidalMpc) followed by whole-body control, watched by a SafetyMonitor.

    .. pydrake_system::

        name: tracking
        input_ports:
        - robot_state
        - reference
        - abort (optional)
        output_ports:
        - feedforward_torque
        - desired_joint_state
        - mpc_policy
        - wbc_status
        - safety_status

    - robot_state: RobotState, frame W.
    - reference: WholeBodyReference in absolute time, frame W; without samples: stand.
    - abort (optional): bool; True drops the reference while it lasts.
    - feedforward_torque: [N m], vector (12,).
    - desired_joint_state: joint positions [rad] and velocities [rad/s], vector (24,).
    - mpc_policy, wbc_status: MpcPolicy and WholeBodyCommand, what the controllers do.
    - safety_status: SafetyStatus; while it is unstable the reference is dropped and the robot stabilises.
    """

    def __init__(self, robot, config: TrackingConfig | None = None, timings=None):
        super().__init__()
        config = config or TrackingConfig()
        builder = DiagramBuilder()
        mpc = builder.AddSystem(CentroidalMpc(robot, config.mpc, period=1.0 / config.mpc_rate, timings=timings))
        wbc = builder.AddSystem(WholeBodyController(robot, config.wbc, period=1.0 / config.wbc_rate, timings=timings))
        safety = builder.AddSystem(SafetyMonitor(robot, config.safety, period=1.0 / config.safety_rate))
        builder.ExportInput(mpc.GetInputPort("robot_state"), "robot_state")
        builder.ConnectInput("robot_state", wbc.GetInputPort("robot_state"))
        builder.ConnectInput("robot_state", safety.GetInputPort("robot_state"))
        builder.ExportInput(safety.GetInputPort("reference"), "reference")
        builder.ExportInput(safety.GetInputPort("abort"), "abort")
        builder.Connect(safety.GetOutputPort("safe_reference"), mpc.GetInputPort("reference"))
        builder.Connect(mpc.GetOutputPort("mpc_policy"), safety.GetInputPort("mpc_policy"))
        builder.Connect(mpc.GetOutputPort("mpc_policy"), wbc.GetInputPort("mpc_policy"))
        builder.ExportOutput(wbc.GetOutputPort("feedforward_torque"), "feedforward_torque")
        builder.ExportOutput(wbc.GetOutputPort("desired_joint_state"), "desired_joint_state")
        builder.ExportOutput(mpc.GetOutputPort("mpc_policy"), "mpc_policy")
        builder.ExportOutput(wbc.GetOutputPort("wbc_status"), "wbc_status")
        builder.ExportOutput(safety.GetOutputPort("safety_status"), "safety_status")
        builder.BuildInto(self)
        self.set_name("tracking")


def make_tracking_module(robot, config: TrackingConfig | None = None, timings=None) -> TrackingModule:
    """Builds the module; ``timings`` (StageTimings) collects the stages' computing times."""
    return TrackingModule(robot, config, timings)
