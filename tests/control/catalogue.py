"""One instance of every LeafSystem of this stage, for the test that compares docstrings with ports."""

from quadpips_drake.control.centroidal_mpc_system import CentroidalMpc
from quadpips_drake.control.reference_publisher_system import ReferencePublisher
from quadpips_drake.control.safety_monitor_system import SafetyMonitor
from quadpips_drake.control.scripted_command_system import ScriptedCommand
from quadpips_drake.control.velocity_reference_system import VelocityReference
from quadpips_drake.control.whole_body_controller_system import WholeBodyController
from quadpips_drake.robots.robot_model import load_robot


def make_systems() -> list:
    robot = load_robot("anymal_c")
    return [
        CentroidalMpc(robot),
        ReferencePublisher(),
        SafetyMonitor(robot),
        ScriptedCommand([]),
        VelocityReference(robot),
        WholeBodyController(robot),
    ]
