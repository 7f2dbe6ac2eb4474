"""One instance of every system of the baselines, for the test that compares docstrings with ports."""

from quadpips_drake.baselines.goal_command_system import GoalCommand
from quadpips_drake.baselines.heuristic_module import HeuristicModule
from quadpips_drake.baselines.motion_models.command_sequence import HeldCommand
from quadpips_drake.baselines.motion_models.command_sequence_system import SequencedCommand
from quadpips_drake.baselines.perceptive_reference_system import PerceptiveReference
from quadpips_drake.robots.robot_library import load_robot


def make_systems() -> list:
    robot = load_robot("anymal_c")
    sequence = SequencedCommand(robot, "trot", [HeldCommand((0.3, 0.0, 0.0), 1)])
    return [GoalCommand(), PerceptiveReference(robot), HeuristicModule(robot), sequence]
