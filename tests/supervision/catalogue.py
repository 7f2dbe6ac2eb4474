"""One instance of every LeafSystem of this stage, for the test that compares docstrings with ports."""

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.supervision.reference_publisher_system import ReferencePublisher
from quadpips_drake.supervision.replan_monitor_system import ReplanMonitor
from quadpips_drake.supervision.safety_monitor_system import SafetyMonitor


def make_systems() -> list:
    return [ReferencePublisher(), ReplanMonitor(load_robot("anymal_c")), SafetyMonitor(load_robot("anymal_c"))]
