"""One instance of every LeafSystem of this stage, for the test that compares docstrings with ports."""

from quadpips_drake.control.mpc.centroidal_mpc_system import CentroidalMpc
from quadpips_drake.control.references.scripted_command_system import ScriptedCommand
from quadpips_drake.control.references.velocity_reference_system import VelocityReference
from quadpips_drake.control.whole_body.whole_body_controller_system import WholeBodyController
from quadpips_drake.robots.robot_library import load_robot


def make_systems() -> list:
    robot = load_robot("anymal_c")
    return [
        CentroidalMpc(robot),
        ScriptedCommand([]),
        VelocityReference(robot),
        WholeBodyController(robot),
    ]
