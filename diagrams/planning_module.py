"""The planning module: from planar regions and a goal to a whole-body reference."""

from dataclasses import dataclass, field

from pydrake.systems.framework import Diagram, DiagramBuilder

from quadpips_drake.errors import UserInputError
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_planner_system import FootholdPlanner
from quadpips_drake.planning.torso.torso_planner_system import TorsoPlanner
from quadpips_drake.planning.torso.torso_search import TorsoConfig
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.supervision.reference_publisher import ReferencePublisherConfig
from quadpips_drake.supervision.reference_publisher_system import ReferencePublisher
from quadpips_drake.supervision.replan_monitor import MonitorConfig
from quadpips_drake.supervision.replan_monitor_system import ReplanMonitor
from quadpips_drake.timing import StageTimings
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizerConfig
from quadpips_drake.trajectory.swing.swing_optimizer_system import SwingTrajectoryOptimizer


@dataclass
class PlanningConfig:
    """The searches, the swing optimisation, and when they happen."""

    torso_rate: float = 30.0
    """How often the torso search looks for a new request [Hz] (QuadPiPS: 30)."""
    foothold_rate: float = 15.0
    """How often the foothold search looks for a new torso path [Hz] (QuadPiPS: 15)."""
    swing_rate: float = 50.0
    """How often the swing optimiser looks for a new foothold plan [Hz]."""
    monitor_rate: float = 10.0
    """How often the monitor looks at everything [Hz] (the authors' release: 10)."""
    torso: TorsoConfig = field(default_factory=TorsoConfig)
    footholds: FootholdConfig = field(default_factory=FootholdConfig)
    swings: SwingOptimizerConfig = field(default_factory=SwingOptimizerConfig)
    publisher: ReferencePublisherConfig = field(default_factory=ReferencePublisherConfig)
    monitor: MonitorConfig = field(default_factory=MonitorConfig)

    def __post_init__(self):
        for name in ("torso_rate", "foothold_rate", "swing_rate", "monitor_rate"):
            if not 0.0 < getattr(self, name) <= 1000.0:
                raise UserInputError(f"planning.{name} must be between 0 and 1000 Hz, is {getattr(self, name)}")


class PlanningModule(Diagram):
    """Torso search, foothold search, swing optimisation and publication, driven by the replan monitor.

    TorsoPlanner -> FootholdPlanner -> SwingTrajectoryOptimizer -> ReferencePublisher; ReplanMonitor asks the first for plans
    and watches the last (QuadPiPS sections VI and VII-A).

    .. pydrake_system::

        name: planning
        input_ports:
        - robot_state
        - region_set
        - safety_status (optional)
        output_ports:
        - reference
        - foothold_plan
        - torso_path
        - swing_plan
        - monitor_status

    - robot_state: RobotState, frame W.
    - region_set: RegionSet, frame W.
    - safety_status (optional): SafetyStatus; while it is unstable the reference is dropped.
    - reference: WholeBodyReference to follow, frame W, absolute times; without samples while there is nothing to follow.
    - foothold_plan, torso_path, swing_plan: what the stages made of the last request.
    - monitor_status: MonitorStatus, what is going on.
    """

    def __init__(
        self, robot: RobotModel, goal, config: PlanningConfig | None = None, *, timings: StageTimings | None = None
    ):
        """Builds the module for the goal x, y [m] in W; ``timings`` collects the stages' computing times."""
        super().__init__()
        config = config or PlanningConfig()
        builder = DiagramBuilder()
        torso = builder.AddSystem(TorsoPlanner(robot, config.torso, period=1 / config.torso_rate, timings=timings))
        footholds = builder.AddSystem(
            FootholdPlanner(robot, config.footholds, period=1 / config.foothold_rate, timings=timings)
        )
        swings = builder.AddSystem(
            SwingTrajectoryOptimizer(robot, config.swings, period=1 / config.swing_rate, timings=timings)
        )
        publisher = builder.AddSystem(ReferencePublisher(config.publisher))
        monitor = builder.AddSystem(ReplanMonitor(goal, config.monitor, period=1 / config.monitor_rate))

        builder.Connect(torso.GetOutputPort("torso_path"), footholds.GetInputPort("torso_path"))
        builder.Connect(footholds.GetOutputPort("foothold_plan"), swings.GetInputPort("foothold_plan"))
        builder.Connect(swings.GetOutputPort("reference"), publisher.GetInputPort("planned_reference"))
        builder.Connect(publisher.GetOutputPort("reference"), monitor.GetInputPort("reference"))
        builder.Connect(footholds.GetOutputPort("foothold_plan"), monitor.GetInputPort("foothold_plan"))
        builder.Connect(swings.GetOutputPort("status"), monitor.GetInputPort("trajectory_status"))
        builder.Connect(monitor.GetOutputPort("plan_request"), torso.GetInputPort("plan_request"))
        builder.Connect(monitor.GetOutputPort("abort"), publisher.GetInputPort("abort"))

        builder.ExportInput(torso.GetInputPort("robot_state"), "robot_state")
        for system in (footholds, swings, monitor):
            builder.ConnectInput("robot_state", system.GetInputPort("robot_state"))
        builder.ExportInput(torso.GetInputPort("region_set"), "region_set")
        builder.ExportInput(monitor.GetInputPort("safety_status"), "safety_status")
        builder.ExportOutput(publisher.GetOutputPort("reference"), "reference")
        builder.ExportOutput(footholds.GetOutputPort("foothold_plan"), "foothold_plan")
        builder.ExportOutput(torso.GetOutputPort("torso_path"), "torso_path")
        builder.ExportOutput(swings.GetOutputPort("swing_plan"), "swing_plan")
        builder.ExportOutput(monitor.GetOutputPort("status"), "monitor_status")
        builder.BuildInto(self)
        self.set_name("planning")
