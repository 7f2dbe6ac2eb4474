"""One instance of every LeafSystem of this stage, for the test that compares docstrings with ports."""

from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.experience_recorder_system import ExperienceRecorder
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_planner_system import FootholdPlanner
from quadpips_drake.planning.torso.torso_planner_system import TorsoPlanner
from quadpips_drake.robots.robot_library import load_robot


def make_systems() -> list:
    robot = load_robot("anymal_c")
    weighing = FootholdPlanner(robot, FootholdConfig(steppability="penalty"))
    remembering = FootholdPlanner(robot, experience=ExperienceConfig(scope="general"))
    return [TorsoPlanner(robot), FootholdPlanner(robot), weighing, remembering, ExperienceRecorder()]
