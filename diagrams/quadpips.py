"""The whole system: a robot in its simulated world that sees, plans and walks (QuadPiPS figure 2)."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydrake.geometry import MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.systems.framework import Diagram

from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.diagrams.planning_module import PlanningConfig, PlanningModule
from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.diagrams.tracking_module import TrackingConfig, TrackingModule
from quadpips_drake.errors import unknown_name
from quadpips_drake.estimation.drifting_state_estimator_system import DriftingStateEstimator
from quadpips_drake.estimation.pose_drift import PoseDriftConfig
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig
from quadpips_drake.perception.regions.oracle_regions_system import OracleRegions
from quadpips_drake.perception.steppability.steppability_config import SteppabilityConfig
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.swing_plan import SwingPlan
from quadpips_drake.visualization.meshcat_layers import draw_course
from quadpips_drake.visualization.plan_visualizer_system import PlanVisualizer
from quadpips_drake.visualization.recording import FRAMES_PER_SECOND, save_recording, start_recording

REGION_SOURCES = ("camera", "oracle")


def _perception() -> PerceptionConfig:
    """Perception with the steppability network; the module by itself judges ground by its geometry alone."""
    return PerceptionConfig(steppability=SteppabilityConfig(enabled=True))


@dataclass
class QuadpipsConfig:
    """All stages, in the order in which data flows."""

    station: StationConfig = field(default_factory=StationConfig)
    drift: PoseDriftConfig = field(default_factory=PoseDriftConfig)
    """How the state estimate that all stages work with drifts away from the truth."""
    region_source: str = "camera"
    """Where planar regions come from: camera, or oracle (exact ones from the terrain, for finding faults)."""
    perception: PerceptionConfig = field(default_factory=_perception)
    oracle_regions: OracleRegionConfig = field(default_factory=OracleRegionConfig)
    planning: PlanningConfig = field(default_factory=PlanningConfig)
    tracking: TrackingConfig = field(default_factory=TrackingConfig)

    def __post_init__(self):
        if self.region_source not in REGION_SOURCES:
            raise unknown_name("region source", self.region_source, REGION_SOURCES)


@dataclass(frozen=True)
class Observation:
    """What an onlooker sees of the running diagram."""

    robot_state: RobotState
    foot_positions: np.ndarray
    """Centres of the feet in W [m], (4, 3)."""
    body_touches: bool
    """Whether the torso touches anything."""
    reference: WholeBodyReference
    """What is being tracked."""
    phase: str
    """What the ReplanMonitor is about."""
    gave_up: str
    """Why planning has given up; empty while it has not."""
    replans: int
    swing_plan: SwingPlan
    """What the swing optimiser made of the last request."""
    fallbacks: dict
    """How often each controller had to fall back so far."""


class QuadpipsDiagram(Diagram):
    """Station -> perception -> planning -> tracking -> station.

    .. pydrake_system::

        name: QuadpipsDiagram
        input_ports: []
        output_ports: []

    Args:
        robot: model of the robot.
        terrain: world, start and goal.
        config: all stages' parameters.
        seed: of all random numbers.
        timings: collects the stages' computing times.
        meshcat: where to draw; None draws nothing.
    """

    def __init__(
        self,
        robot: RobotModel,
        terrain: Terrain,
        config: QuadpipsConfig | None = None,
        *,
        seed: int = 0,
        timings: StageTimings | None = None,
        meshcat=None,
    ):
        super().__init__()
        self._config = config or QuadpipsConfig()
        self._terrain, self._meshcat = terrain, meshcat
        builder = DiagramBuilder()
        self.station = builder.AddSystem(SimulationStation(robot, terrain, self._config.station))
        self.robot = self.station.robot
        robot_state = self._add_state_estimate(builder, seed)
        regions = self._add_regions(builder, robot_state, timings, seed)
        self._regions = regions
        self.planning = builder.AddSystem(PlanningModule(self.robot, terrain.goal, self._config.planning, timings=timings))
        self.tracking = builder.AddSystem(TrackingModule(self.robot, self._config.tracking, timings))
        builder.Connect(robot_state, self.planning.GetInputPort("robot_state"))
        builder.Connect(regions, self.planning.GetInputPort("region_set"))
        builder.Connect(robot_state, self.tracking.GetInputPort("robot_state"))
        builder.Connect(self.planning.GetOutputPort("reference"), self.tracking.GetInputPort("reference"))
        builder.Connect(self.tracking.GetOutputPort("safety_status"), self.planning.GetInputPort("safety_status"))
        for port in ("feedforward_torque", "desired_joint_state"):
            builder.Connect(self.tracking.GetOutputPort(port), self.station.GetInputPort(port))
        if meshcat is not None:
            self._add_visualizers(builder, regions)
        builder.BuildInto(self)
        self.set_name("quadpips")

    def set_initial_state(self, root_context, start) -> None:
        """Stands the robot on the terrain at ``start`` (x, y [m], yaw [rad]); raises UserInputError where it cannot."""
        self.station.set_initial_state(root_context, *start)

    def observe(self, root_context) -> Observation:
        """Returns what there is to see at the context's time."""
        state = self._eval(self.station, "robot_state", root_context)
        status = self._eval(self.planning, "monitor_status", root_context)
        policy = self._eval(self.tracking, "mpc_policy", root_context)
        wbc = self._eval(self.tracking, "wbc_status", root_context)
        safety = self._eval(self.tracking, "safety_status", root_context)
        feet = self.robot.foot_positions_W(state)
        return Observation(
            robot_state=state,
            foot_positions=feet,
            body_touches="base" in self.station.touching_links(root_context),
            reference=self._eval(self.planning, "reference", root_context),
            phase=status.phase,
            gave_up=status.reason if status.phase == "no_plan" else "",
            replans=status.replans,
            swing_plan=self._eval(self.planning, "swing_plan", root_context),
            fallbacks={
                "failed_plans": status.failed_plans,
                "aborted_references": status.aborts,
                "mpc": policy.fallbacks,
                "wbc": wbc.fallbacks,
                **{f"unstable_{event}": count for event, count in safety.counts_by_event().items()},
            },
        )

    def region_set(self, root_context) -> RegionSet:
        """Returns the regions that planning sees."""
        return self._regions.Eval(self._regions.get_system().GetMyContextFromRoot(root_context))

    def draw_course(self) -> None:
        """Sets the stage in Meshcat."""
        draw_course(self._meshcat, self._terrain)

    def start_recording(self) -> None:
        """Lets Meshcat record from now on."""
        start_recording(self._meshcat)

    def save_recording(self, path: Path) -> None:
        """Ends the recording and writes it as one HTML file."""
        save_recording(self._meshcat, path, title=f"{self.robot.name} on {self._terrain.name}")

    @staticmethod
    def _eval(system, port: str, root_context):
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(root_context))

    def _add_state_estimate(self, builder: DiagramBuilder, seed: int):
        """Returns the port of the robot state that all stages work with; adds a drift where one is wanted."""
        truth = self.station.GetOutputPort("robot_state")
        if not self._config.drift.enabled:
            return truth
        drift = builder.AddNamedSystem("drifting_state_estimator", DriftingStateEstimator(self._config.drift, seed=seed))
        builder.Connect(truth, drift.GetInputPort("robot_state"))
        return drift.GetOutputPort("robot_state")

    def _add_regions(self, builder: DiagramBuilder, robot_state, timings: StageTimings | None, seed: int):
        """Adds the source of regions and returns its port."""
        if self._config.region_source == "oracle":
            oracle = OracleRegions(self._terrain, self.robot.foot_radius, self._config.oracle_regions, timings=timings)
            builder.AddNamedSystem("oracle_regions", oracle)
            builder.Connect(robot_state, oracle.GetInputPort("robot_state"))
            return oracle.GetOutputPort("region_set")
        perception = builder.AddSystem(
            PerceptionModule(
                self.robot,
                self.station.camera_intrinsics,
                self._config.perception,
                timings,
                camera=self._config.station.camera_name,
                further_cameras=self._config.station.further_cameras,
                seed=seed,
            )
        )
        for suffix in ("", *(f"_{name}" for name in self._config.station.further_cameras)):
            port = "depth_image" + suffix
            builder.Connect(self.station.GetOutputPort(port), perception.GetInputPort(port))
        builder.Connect(robot_state, perception.GetInputPort("robot_state"))
        return perception.GetOutputPort("region_set")

    def _add_visualizers(self, builder: DiagramBuilder, regions) -> None:
        params = MeshcatVisualizerParams(publish_period=1.0 / FRAMES_PER_SECOND)
        MeshcatVisualizer.AddToBuilder(builder, self.station.GetOutputPort("query_object"), self._meshcat, params)
        plans = builder.AddNamedSystem("plan_visualizer", PlanVisualizer(self.robot, self._meshcat))
        builder.Connect(regions, plans.GetInputPort("region_set"))
        for port in ("reference", "foothold_plan"):
            builder.Connect(self.planning.GetOutputPort(port), plans.GetInputPort(port))
        source = regions.get_system()
        if source.HasOutputPort("affordance_image"):
            builder.Connect(source.GetOutputPort("affordance_image"), plans.GetInputPort("affordance_image"))
