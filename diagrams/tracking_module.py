"""The tracking module: from the robot's state and a whole-body reference to torques."""

from dataclasses import field

from quadpips_drake.configuration.schema import configuration
from quadpips_drake.control.mpc.centroidal_mpc_system import CentroidalMpc
from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.control.whole_body.whole_body_controller_system import WholeBodyController
from quadpips_drake.errors import UserInputError
from quadpips_drake.faults.control_faults import ControlFaultConfig
from quadpips_drake.faults.failing_mpc_system import FailingMpc
from quadpips_drake.faults.raised_footholds_system import RaisedFootholds
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.supervision.safety import SafetyConfig
from quadpips_drake.supervision.safety_monitor_system import SafetyMonitor


@configuration
class TrackingConfig:
    """Safety monitor, model predictive and whole-body control."""

    safety: SafetyConfig = field(default_factory=SafetyConfig)
    mpc: MpcConfig = field(default_factory=MpcConfig)
    wbc: WbcConfig = field(default_factory=WbcConfig)
    faults: ControlFaultConfig = field(default_factory=ControlFaultConfig)
    """What is to go wrong, for studies."""

    def __post_init__(self):
        if not self.mpc.rate <= self.wbc.rate:
            raise UserInputError(f"mpc.rate must not exceed wbc.rate, is {self.mpc.rate:g} of {self.wbc.rate:g} Hz")


class TrackingModule(Diagram):
    """Model predictive control (CentroidalMpc) followed by whole-body control, watched by a SafetyMonitor.

    .. pydrake_system::

        name: TrackingModule
        input_ports:
        - robot_state
        - reference
        - abort (optional)
        - signed_distance (optional)
        output_ports:
        - feedforward_torque
        - desired_joint_state
        - mpc_policy
        - wbc_status
        - safety_status

    - robot_state: RobotState, frame W.
    - reference: WholeBodyReference in absolute time, frame W; without samples: stand.
    - abort (optional): bool; True drops the reference while it lasts.
    - signed_distance (optional): SignedDistance from the ground, frame W, that knees and trunk keep if the MPC is told to.
    - feedforward_torque: [N m], vector (12,).
    - desired_joint_state: joint positions [rad] and velocities [rad/s], vector (24,).
    - mpc_policy, wbc_status: MpcPolicy and WholeBodyCommand, what the controllers do.
    - safety_status: SafetyStatus; while it is unstable the reference is dropped and the robot stabilises.
    """

    def __init__(self, robot, config: TrackingConfig | None = None, timings=None):
        super().__init__()
        config = config or TrackingConfig()
        builder = DiagramBuilder()
        mpc = builder.AddSystem(_make_mpc(robot, config, timings))
        wbc = builder.AddSystem(WholeBodyController(robot, config.wbc, timings=timings))
        safety = builder.AddSystem(SafetyMonitor(robot, config.safety, timings=timings))
        builder.ExportInput(mpc.GetInputPort("robot_state"), "robot_state")
        builder.ConnectInput("robot_state", wbc.GetInputPort("robot_state"))
        builder.ConnectInput("robot_state", safety.GetInputPort("robot_state"))
        builder.ExportInput(safety.GetInputPort("reference"), "reference")
        builder.ExportInput(safety.GetInputPort("abort"), "abort")
        builder.ExportInput(mpc.GetInputPort("signed_distance"), "signed_distance")
        reference = safety.GetOutputPort("safe_reference")
        if config.faults.terrain_height_error:
            raised = builder.AddSystem(RaisedFootholds(config.faults.terrain_height_error))
            builder.Connect(reference, raised.GetInputPort("reference"))
            reference = raised.GetOutputPort("raised_reference")
        builder.Connect(reference, mpc.GetInputPort("reference"))
        builder.Connect(mpc.GetOutputPort("mpc_policy"), safety.GetInputPort("mpc_policy"))
        builder.Connect(mpc.GetOutputPort("mpc_policy"), wbc.GetInputPort("mpc_policy"))
        builder.ExportOutput(wbc.GetOutputPort("feedforward_torque"), "feedforward_torque")
        builder.ExportOutput(wbc.GetOutputPort("desired_joint_state"), "desired_joint_state")
        builder.ExportOutput(mpc.GetOutputPort("mpc_policy"), "mpc_policy")
        builder.ExportOutput(wbc.GetOutputPort("wbc_status"), "wbc_status")
        builder.ExportOutput(safety.GetOutputPort("safety_status"), "safety_status")
        builder.BuildInto(self)
        self.set_name("tracking")


def _make_mpc(robot, config: TrackingConfig, timings) -> CentroidalMpc:
    early = config.wbc.early_contact_phase
    if config.faults.outage_start:
        return FailingMpc(robot, config.mpc, config.faults, early_contact_phase=early, timings=timings)
    return CentroidalMpc(robot, config.mpc, early_contact_phase=early, timings=timings)
