"""One instance of every LeafSystem of this stage, for the test that compares docstrings with ports."""

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trajectory.swing.swing_optimizer_system import SwingTrajectoryOptimizer


def make_systems() -> list:
    return [SwingTrajectoryOptimizer(load_robot("anymal_c"))]
