"""The tracking module: from the robot's state and a whole-body reference to torques."""

from dataclasses import dataclass, field

from pydrake.systems.framework import Diagram, DiagramBuilder

from quadpips_drake.control.centroidal_mpc import MpcConfig
from quadpips_drake.control.centroidal_mpc_system import CentroidalMpc
from quadpips_drake.control.whole_body_config import WbcConfig
from quadpips_drake.control.whole_body_controller_system import WholeBodyController
from quadpips_drake.errors import UserInputError


@dataclass
class TrackingConfig:
    """Model predictive and whole-body control."""

    mpc_rate: float = 50.0
    """[Hz] (QuadPiPS: 50)"""
    wbc_rate: float = 500.0
    """[Hz] (QuadPiPS: 500 to 1000)"""
    mpc: MpcConfig = field(default_factory=MpcConfig)
    wbc: WbcConfig = field(default_factory=WbcConfig)

    def __post_init__(self):
        if not 0.0 < self.mpc_rate <= self.wbc_rate:
            raise UserInputError("tracking needs 0 < mpc_rate <= wbc_rate")


class TrackingModule(Diagram):
    """Model predictive control (CentroidalMpc) followed by whole-body control (WholeBodyController).

    .. pydrake_system::

        name: tracking
        input_ports:
        - robot_state
        - reference
        output_ports:
        - feedforward_torque
        - desired_joint_state
        - mpc_policy
        - wbc_status
    """

    def __init__(self, robot, config: TrackingConfig | None = None, timings=None):
        super().__init__()
        config = config or TrackingConfig()
        builder = DiagramBuilder()
        mpc = builder.AddSystem(CentroidalMpc(robot, config.mpc, period=1.0 / config.mpc_rate, timings=timings))
        wbc = builder.AddSystem(WholeBodyController(robot, config.wbc, period=1.0 / config.wbc_rate, timings=timings))
        builder.ExportInput(mpc.GetInputPort("robot_state"), "robot_state")
        builder.ConnectInput("robot_state", wbc.GetInputPort("robot_state"))
        builder.ExportInput(mpc.GetInputPort("reference"), "reference")
        builder.Connect(mpc.GetOutputPort("mpc_policy"), wbc.GetInputPort("mpc_policy"))
        builder.ExportOutput(wbc.GetOutputPort("feedforward_torque"), "feedforward_torque")
        builder.ExportOutput(wbc.GetOutputPort("desired_joint_state"), "desired_joint_state")
        builder.ExportOutput(mpc.GetOutputPort("mpc_policy"), "mpc_policy")
        builder.ExportOutput(wbc.GetOutputPort("wbc_status"), "wbc_status")
        builder.BuildInto(self)
        self.set_name("tracking")


def make_tracking_module(robot, config: TrackingConfig | None = None, timings=None) -> TrackingModule:
    """Builds the module; ``timings`` (StageTimings) collects the stages' computing times."""
    return TrackingModule(robot, config, timings)
