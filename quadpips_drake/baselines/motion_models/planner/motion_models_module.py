"""The planner ``motion_models``: from ground that was seen and a goal to velocity commands, and a walk that follows them."""

from dataclasses import field
from pathlib import Path

from quadpips_drake.baselines.motion_models.planner.costmap_visualizer_system import CostmapVisualizer
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmapConfig
from quadpips_drake.baselines.motion_models.planner.foot_costmap_system import FootCostmapBuilder, OracleFootCostmap
from quadpips_drake.baselines.motion_models.planner.variants import VARIANTS, belief_of, check_gait
from quadpips_drake.baselines.motion_models.planner.velocity_planner_config import VelocityPlannerConfig
from quadpips_drake.baselines.motion_models.planner.velocity_planner_system import VelocityPlanner
from quadpips_drake.baselines.motion_models.walk_settings import motion_models_walk
from quadpips_drake.configuration.schema import configuration
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig
from quadpips_drake.control.references.velocity_reference_system import VelocityReference
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.timing import StageTimings


@configuration
class MotionModelsConfig:
    """The planner over velocity commands, and the walk that it commands."""

    variant: str = "learned"
    """What it believes that a command leads to: learned, ideal, kinematic, or blind (it looks at nothing)."""
    gait: str = "trot"
    """In which it walks: trot, standing_trot or slow_trot."""
    models: str = ""
    """Directory of learned models, as 'quadpips motion-models train' writes them; empty: those of the package."""
    planner: VelocityPlannerConfig = field(default_factory=VelocityPlannerConfig)
    costmap: FootCostmapConfig = field(default_factory=FootCostmapConfig)
    velocity_reference: VelocityReferenceConfig = field(default_factory=motion_models_walk)
    """Of the walk. The planner does not see it; learned models are of one walk, and refuse another."""

    def __post_init__(self):
        if self.variant not in VARIANTS:
            raise unknown_name("variant of motion models", self.variant, VARIANTS)
        check_gait(self.gait)
        if self.planner.adaptation.enabled and self.variant != "learned":
            raise UserInputError(f"only learned models go on learning (planner.adaptation.enabled), not '{self.variant}'")


class MotionModelsModule(Diagram):
    """Foot costmap -> VelocityPlanner -> VelocityReference, the walk that takes velocity commands and nothing else.

    The costmap comes from a FootCostmapBuilder, or, where there is an exact map, from an OracleFootCostmap.

    .. pydrake_system::

        name: MotionModelsModule
        input_ports:
        - robot_state
        - ground_heights (optional)
        - safety_status (optional)
        - goal
        output_ports:
        - reference
        - plan
        - status
        - foot_costmap
        - velocity_command
        - gait
        - velocity_plan
        - report

    - robot_state: RobotState, frame W.
    - ground_heights (optional): GroundHeights that perception remembers, frame W; not there with an exact map.
    - safety_status (optional): SafetyStatus; while it is unstable the robot is to stand where it is.
    - goal: x, y in W [m], vector (2,).
    - reference: WholeBodyReference in absolute time, frame W, of a walk as commanded.
    - plan: PlanSketch of the planned footholds, frame W.
    - status: PlannerStatus, what is going on.
    - foot_costmap: FootCostmap that is planned with, frame W.
    - velocity_command: forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot, vector (3,).
    - gait: str, name of the gait that is commanded.
    - velocity_plan: VelocityPlan, frame W; the newest one.
    - report: PlannerReport, see VelocityPlanner.
    """

    def __init__(
        self,
        robot: RobotModel,
        config: MotionModelsConfig | None = None,
        *,
        tracking=None,
        truth: Terrain | None = None,
        timings: StageTimings | None = None,
    ):
        """
        Args:
            robot: model of the robot.
            config: of all.
            tracking: TrackingConfig of what follows the reference: learned models are checked against it; None: not to be
                checked.
            truth: the terrain, for an exact map; None: the map is what perception remembers.
            timings: collects the stages' computing times.

        Raises:
            UserInputError: the models cannot be had, or are of another walk.
        """
        super().__init__()
        self._robot, config = robot, config or MotionModelsConfig()
        directory = Path(config.models) if config.models else None
        belief = belief_of(config.variant, robot, config.gait, directory, config.velocity_reference, tracking)
        builder = DiagramBuilder()
        if truth is None:
            costmap = builder.AddSystem(FootCostmapBuilder(config.costmap, timings=timings))
        else:
            costmap = builder.AddSystem(OracleFootCostmap(truth, config.costmap, timings=timings))
        planner = builder.AddSystem(VelocityPlanner(robot, config.gait, belief, config.planner, timings=timings))
        walk = builder.AddSystem(VelocityReference(robot, config.velocity_reference, timings=timings))

        builder.Connect(costmap.GetOutputPort("foot_costmap"), planner.GetInputPort("foot_costmap"))
        for port in ("velocity_command", "gait"):
            builder.Connect(planner.GetOutputPort(port), walk.GetInputPort(port))
        builder.ExportInput(planner.GetInputPort("robot_state"), "robot_state")
        builder.ConnectInput("robot_state", walk.GetInputPort("robot_state"))
        if truth is None:
            builder.ExportInput(costmap.GetInputPort("ground_heights"), "ground_heights")
        else:
            builder.ConnectInput("robot_state", costmap.GetInputPort("robot_state"))
        builder.ExportInput(planner.GetInputPort("safety_status"), "safety_status")
        builder.ConnectInput("safety_status", walk.GetInputPort("safety_status"))
        builder.ExportInput(planner.GetInputPort("goal"), "goal")
        builder.ExportOutput(walk.GetOutputPort("reference"), "reference")
        for port in ("plan", "status"):
            builder.ExportOutput(planner.GetOutputPort(port), port)
        builder.ExportOutput(costmap.GetOutputPort("foot_costmap"), "foot_costmap")
        for port in ("velocity_command", "gait", "velocity_plan", "report"):
            builder.ExportOutput(planner.GetOutputPort(port), port)
        builder.BuildInto(self)
        self.set_name("motion_models")

    def make_visualizer(self, meshcat) -> CostmapVisualizer:
        """What draws the costmap, and where feet came down, into ``meshcat``."""
        return CostmapVisualizer(self._robot, meshcat)
