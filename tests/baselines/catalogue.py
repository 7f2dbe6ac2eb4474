"""One instance of every system of the baselines, for the test that compares docstrings with ports."""

from quadpips_drake.baselines.goal_command_system import GoalCommand
from quadpips_drake.baselines.heuristic_module import HeuristicModule
from quadpips_drake.baselines.motion_models.command_sequence import HeldCommand
from quadpips_drake.baselines.motion_models.command_sequence_system import SequencedCommand
from quadpips_drake.baselines.motion_models.planner.costmap_visualizer_system import CostmapVisualizer
from quadpips_drake.baselines.motion_models.planner.foot_costmap_system import FootCostmapBuilder, OracleFootCostmap
from quadpips_drake.baselines.motion_models.planner.motion_models_module import MotionModelsConfig, MotionModelsModule
from quadpips_drake.baselines.motion_models.planner.velocity_planner_system import VelocityPlanner
from quadpips_drake.baselines.perceptive_reference_system import PerceptiveReference
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain


def make_systems() -> list:
    robot, terrain, config = load_robot("anymal_c"), load_terrain("flat"), MotionModelsConfig(variant="ideal")
    return [
        GoalCommand(),
        PerceptiveReference(robot),
        HeuristicModule(robot),
        SequencedCommand(robot, "trot", [HeldCommand((0.3, 0.0, 0.0), 1)]),
        FootCostmapBuilder(),
        OracleFootCostmap(terrain),
        CostmapVisualizer(robot, None),
        VelocityPlanner(robot, "trot", None),
        MotionModelsModule(robot, config),
        MotionModelsModule(robot, config, truth=terrain),
    ]
