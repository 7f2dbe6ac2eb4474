"""The heuristic module: from planar regions and a goal to a whole-body reference, without a search."""

from dataclasses import field

from quadpips_drake.baselines.goal_command import GoalCommandConfig
from quadpips_drake.baselines.goal_command_system import GoalCommand
from quadpips_drake.baselines.perceptive_config import PerceptiveReferenceConfig
from quadpips_drake.baselines.perceptive_reference_system import PerceptiveReference
from quadpips_drake.configuration.schema import configuration
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.timing import StageTimings


@configuration
class HeuristicConfig:
    """A planner without a search: the twist towards the goal, and heuristic footholds on the regions that are seen."""

    command: GoalCommandConfig = field(default_factory=GoalCommandConfig)
    reference: PerceptiveReferenceConfig = field(default_factory=PerceptiveReferenceConfig)


class HeuristicModule(Diagram):
    """GoalCommand -> PerceptiveReference: rivals of QuadPiPS section VIII, and learned footholds, with the planner's ports.

    .. pydrake_system::

        name: HeuristicModule
        input_ports:
        - robot_state
        - region_set
        - ground_heights (optional)
        - safety_status (optional)
        - goal
        output_ports:
        - reference
        - plan
        - status

    - robot_state: RobotState, frame W.
    - region_set: RegionSet, frame W.
    - ground_heights (optional): GroundHeights that swings clear if ``config.reference.clear_ground`` says so, frame W.
    - safety_status (optional): SafetyStatus; while it is unstable the robot stands, then the walk begins anew.
    - goal: x, y in W [m], vector (2,).
    - reference: WholeBodyReference to follow, frame W, absolute times; a new one at 50 Hz.
    - plan: PlanSketch of the footholds, frame W.
    - status: PlannerStatus, what is going on; it never gives up.
    """

    def __init__(self, robot: RobotModel, config: HeuristicConfig | None = None, *, timings: StageTimings | None = None):
        """``timings`` collects the stages' computing times."""
        super().__init__()
        self.optional_inputs = ["ground_heights"]
        """Inputs that need nothing to feed them."""
        config = config or HeuristicConfig()
        builder = DiagramBuilder()
        command = builder.AddSystem(GoalCommand(config.command, timings=timings))
        walk = builder.AddSystem(PerceptiveReference(robot, config.reference, timings=timings))
        for port in ("velocity_command", "gait"):
            builder.Connect(command.GetOutputPort(port), walk.GetInputPort(port))
        builder.Connect(walk.GetOutputPort("reference_status"), command.GetInputPort("reference_status"))
        builder.ExportInput(command.GetInputPort("robot_state"), "robot_state")
        builder.ConnectInput("robot_state", walk.GetInputPort("robot_state"))
        builder.ExportInput(walk.GetInputPort("region_set"), "region_set")
        builder.ExportInput(walk.GetInputPort("ground_heights"), "ground_heights")
        builder.ExportInput(command.GetInputPort("safety_status"), "safety_status")
        builder.ConnectInput("safety_status", walk.GetInputPort("safety_status"))
        builder.ExportInput(command.GetInputPort("goal"), "goal")
        for port in ("reference", "plan"):
            builder.ExportOutput(walk.GetOutputPort(port), port)
        builder.ExportOutput(command.GetOutputPort("status"), "status")
        builder.BuildInto(self)
        self.set_name("heuristic")
