"""One instance of every LeafSystem of this stage, for the test that compares docstrings with ports."""

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.visualization.camera_follower_system import CameraFollower
from quadpips_drake.visualization.plan_visualizer_system import PlanVisualizer
from quadpips_drake.visualization.push_visualizer_system import PushVisualizer
from quadpips_drake.visualization.recording import make_quiet_meshcat
from quadpips_drake.visualization.walk_panel_system import WalkPanel
from quadpips_drake.visualization.walk_visualizer_system import WalkVisualizer


def make_systems() -> list:
    robot, meshcat = load_robot("anymal_c"), make_quiet_meshcat()
    return [
        PlanVisualizer(robot, meshcat),
        WalkPanel(meshcat, WalkCommand()),
        CameraFollower(robot, meshcat),
        WalkVisualizer(robot, meshcat),
        PushVisualizer(robot, meshcat, []),
    ]
