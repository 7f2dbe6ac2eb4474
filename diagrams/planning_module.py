"""The planning module: from planar regions and a goal to a whole-body reference."""

from dataclasses import field
from functools import partial

from quadpips_drake.configuration.schema import configuration
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.experience_file import configuration_hash, load_library
from quadpips_drake.planning.experience.experience_recorder_system import ExperienceRecorder
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_planner_system import FootholdPlanner
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_planner_system import TorsoPlanner
from quadpips_drake.planning.torso.torso_room import TorsoRoom
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.supervision.reference_publisher import ReferencePublisherConfig
from quadpips_drake.supervision.reference_publisher_system import ReferencePublisher
from quadpips_drake.supervision.replan_monitor import MonitorConfig
from quadpips_drake.supervision.replan_monitor_system import ReplanMonitor
from quadpips_drake.timing import StageTimings
from quadpips_drake.trajectory.swing.swing_clearance import SwingClearance
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizerConfig
from quadpips_drake.trajectory.swing.swing_optimizer_system import SwingTrajectoryOptimizer
from quadpips_drake.values.swing_plan import ExperienceLibrary


@configuration
class PlanningConfig:
    """The searches, the swing optimisation, when they happen, and what is remembered of them."""

    torso: TorsoConfig = field(default_factory=TorsoConfig)
    footholds: FootholdConfig = field(default_factory=FootholdConfig)
    swings: SwingOptimizerConfig = field(default_factory=SwingOptimizerConfig)
    publisher: ReferencePublisherConfig = field(default_factory=ReferencePublisherConfig)
    monitor: MonitorConfig = field(default_factory=MonitorConfig)
    experience: ExperienceConfig = field(default_factory=ExperienceConfig)

    @property
    def every_label(self) -> bool:
        """Whether regions of every label are wanted."""
        return self.footholds.every_label


def first_library(robot: RobotModel, config: PlanningConfig, site: str = "") -> ExperienceLibrary:
    """Returns the experience to begin with: that in the file of ``config``, or none, of this robot and configuration.

    Args:
        robot: whose.
        config: with the settings of experience and of the swings that it is about.
        site: fingerprint of the terrain.

    Raises:
        UserInputError: the file cannot be used.
    """
    settings = config.experience
    costs = configuration_hash(config.swings, failure_cost=settings.failure_cost, easy_cost=settings.easy_cost)
    local = settings.scope == "site"
    library = ExperienceLibrary("site" if local else "general", robot.name, costs, site if local else "")
    return load_library(settings.file, library) if settings.file else library


def _what_clears(robot: RobotModel, config: PlanningConfig) -> dict:
    """What the foothold search asks whether feet and torso clear the ground."""
    return {
        "clearance": partial(SwingClearance.over, foot_radius=robot.foot_radius, config=config.swings),
        "room": partial(TorsoRoom, robot, clearance=config.torso.belly_clearance),
    }


class PlanningModule(Diagram):
    """Torso search, foothold search, swing optimisation and publication, driven by the replan monitor.

    TorsoPlanner -> FootholdPlanner -> SwingTrajectoryOptimizer -> ReferencePublisher; ReplanMonitor asks the first for plans
    and watches the last (QuadPiPS sections VI and VII-A).

    .. pydrake_system::

        name: PlanningModule
        input_ports:
        - robot_state
        - region_set
        - ground_heights (optional)
        - label_image (optional)
        - safety_status (optional)
        - goal
        output_ports:
        - reference
        - plan
        - status
        - foothold_plan
        - torso_path
        - swing_plan
        - plan_request
        - experience (optional)

    - robot_state: RobotState, frame W.
    - region_set: RegionSet, frame W.
    - ground_heights (optional): GroundHeights that torso and swings clear and the monitor holds the reference against,
      frame W.
    - label_image (optional): LabelImage by which footholds cost more; only there if ``config.footholds.steppability`` is
      "penalty".
    - safety_status (optional): SafetyStatus; while it is unstable the reference is dropped.
    - goal: x, y in W [m], vector (2,).
    - reference: WholeBodyReference to follow, frame W, absolute times; without samples while there is nothing to follow.
    - plan: PlanSketch of the footholds, frame W.
    - status: PlannerStatus, what is going on.
    - foothold_plan, torso_path, swing_plan: what the stages made of the last request.
    - plan_request: PlanRequest, the last one.
    - experience: ExperienceLibrary, of all swings that were tried; only there unless ``config.experience.scope`` is "off".
    """

    def __init__(
        self,
        robot: RobotModel,
        config: PlanningConfig | None = None,
        *,
        timings: StageTimings | None = None,
        site: str = "",
    ):
        """``timings`` collects the stages' computing times; ``site`` is the fingerprint of the terrain, for experience."""
        super().__init__()
        self.optional_inputs = ["ground_heights", "label_image"]
        """Inputs that need nothing to feed them."""
        config, builder = config or PlanningConfig(), DiagramBuilder()
        torso = builder.AddSystem(TorsoPlanner(robot, config.torso, every_label=config.every_label, timings=timings))
        more = {"experience": config.experience, "timings": timings} | _what_clears(robot, config)
        footholds = builder.AddSystem(FootholdPlanner(robot, config.footholds, **more))
        swings = builder.AddSystem(SwingTrajectoryOptimizer(robot, config.swings, timings=timings))
        publisher = builder.AddSystem(ReferencePublisher(config.publisher, timings=timings))
        is_off = config.footholds.steppability == "off"
        monitor = builder.AddSystem(ReplanMonitor(robot, config.monitor, every_label=is_off, timings=timings))

        builder.Connect(torso.GetOutputPort("torso_path"), footholds.GetInputPort("torso_path"))
        builder.Connect(footholds.GetOutputPort("foothold_plan"), swings.GetInputPort("foothold_plan"))
        builder.Connect(swings.GetOutputPort("reference"), publisher.GetInputPort("planned_reference"))
        builder.Connect(publisher.GetOutputPort("reference"), monitor.GetInputPort("reference"))
        builder.Connect(footholds.GetOutputPort("foothold_plan"), monitor.GetInputPort("foothold_plan"))
        builder.Connect(swings.GetOutputPort("status"), monitor.GetInputPort("trajectory_status"))
        builder.Connect(swings.GetOutputPort("refused_swings"), monitor.GetInputPort("refused_swings"))
        builder.Connect(monitor.GetOutputPort("swings_to_avoid"), footholds.GetInputPort("refused_swings"))
        builder.Connect(monitor.GetOutputPort("plan_request"), torso.GetInputPort("plan_request"))
        builder.Connect(monitor.GetOutputPort("plan_request"), swings.GetInputPort("plan_request"))
        builder.Connect(monitor.GetOutputPort("abort"), publisher.GetInputPort("abort"))
        builder.Connect(monitor.GetOutputPort("cut"), publisher.GetInputPort("cut"))

        if config.experience.enabled:
            recorder = ExperienceRecorder(config.experience, first_library(robot, config, site), timings=timings)
            _add_recorder(builder, recorder, footholds, swings)
        builder.ExportInput(torso.GetInputPort("robot_state"), "robot_state")
        for system in (footholds, swings, monitor):
            builder.ConnectInput("robot_state", system.GetInputPort("robot_state"))
        builder.ExportInput(torso.GetInputPort("region_set"), "region_set")
        builder.ExportInput(swings.GetInputPort("ground_heights"), "ground_heights")
        for system in (swings, monitor):
            builder.ConnectInput("region_set", system.GetInputPort("region_set"))
        for system in (torso, footholds, monitor):
            builder.ConnectInput("ground_heights", system.GetInputPort("ground_heights"))
        if footholds.HasInputPort("label_image"):
            builder.ExportInput(footholds.GetInputPort("label_image"), "label_image")
        builder.ExportInput(monitor.GetInputPort("safety_status"), "safety_status")
        builder.ExportInput(monitor.GetInputPort("goal"), "goal")
        builder.ExportOutput(publisher.GetOutputPort("reference"), "reference")
        builder.ExportOutput(footholds.GetOutputPort("plan"), "plan")
        builder.ExportOutput(monitor.GetOutputPort("status"), "status")
        builder.ExportOutput(footholds.GetOutputPort("foothold_plan"), "foothold_plan")
        builder.ExportOutput(torso.GetOutputPort("torso_path"), "torso_path")
        builder.ExportOutput(swings.GetOutputPort("swing_plan"), "swing_plan")
        builder.ExportOutput(monitor.GetOutputPort("plan_request"), "plan_request")
        builder.BuildInto(self)
        self.set_name("planning")


def _add_recorder(builder: DiagramBuilder, recorder: ExperienceRecorder, footholds, swings) -> None:
    """What is learned of the swings goes back to the foothold search."""
    builder.AddSystem(recorder)
    builder.Connect(footholds.GetOutputPort("foothold_plan"), recorder.GetInputPort("foothold_plan"))
    builder.Connect(swings.GetOutputPort("swing_plan"), recorder.GetInputPort("swing_plan"))
    builder.Connect(recorder.GetOutputPort("experience"), footholds.GetInputPort("experience"))
    builder.ExportOutput(recorder.GetOutputPort("experience"), "experience")
