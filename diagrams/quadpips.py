"""The whole system: a robot in its simulated world that sees, plans and walks (QuadPiPS figure 2)."""

from collections.abc import Sequence
from dataclasses import field, fields, make_dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource

from quadpips_drake.configuration.schema import configuration
from quadpips_drake.diagrams.planners import PlannerSetup, planners
from quadpips_drake.diagrams.planning_module import PlanningConfig
from quadpips_drake.diagrams.pushed_station import add_pushes, draw_pushes
from quadpips_drake.diagrams.region_sources import RegionSourceSetup, region_sources
from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.diagrams.state_estimators import EstimatorSetup, add_state_estimate, check_drift, state_estimators
from quadpips_drake.diagrams.tracking_module import TrackingConfig, TrackingModule
from quadpips_drake.errors import UserInputError
from quadpips_drake.estimation.pose_drift import PoseDriftConfig
from quadpips_drake.faults.push_system import Push
from quadpips_drake.framework.ports import DiagramBuilder, connect_by_name, output_names, output_of
from quadpips_drake.framework.registry import Entry
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.perception.config import PerceptionConfig, steppable_perception
from quadpips_drake.perception.elevation.elevation_config import ElevationConfig
from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import Element, Terrain
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import AffordanceImage, LabelImage
from quadpips_drake.values.plans import PlanSketch
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, RegionSet, SignedDistance
from quadpips_drake.values.status import PlannerStatus
from quadpips_drake.visualization.plan_visualizer_system import PlanVisualizer, PlanVisualizerConfig
from quadpips_drake.visualization.recording import FRAMES_PER_SECOND

_NOT_ALWAYS = {"ground_heights": GroundHeights, "label_image": LabelImage}
"""Outputs for planners that only some region sources have."""


@configuration
class QuadpipsConfig:
    """All stages, in the order in which data flows.

    A planner, region source or state estimator from outside the package brings its own section (see ``stages_type``).
    """

    station: StationConfig = field(default_factory=StationConfig)
    state_estimator: str = "oracle"
    """Who tells where the robot is: oracle, drifting, or one of another package."""
    drift: PoseDriftConfig = field(default_factory=PoseDriftConfig)
    """How the drifting state estimator moves away from the truth."""
    region_source: str = "superpixels"
    """Where planar regions come from: superpixels (by camera), elevation (by camera, from an elevation map), oracle (exact
    ones from the terrain, for finding faults), or one of another package."""
    perception: PerceptionConfig = field(default_factory=steppable_perception)
    oracle_regions: OracleRegionConfig = field(default_factory=OracleRegionConfig)
    planning: PlanningConfig = field(default_factory=PlanningConfig)
    tracking: TrackingConfig = field(default_factory=TrackingConfig)
    elevation: ElevationConfig = field(default_factory=ElevationConfig)

    def __post_init__(self):
        region_sources.get(self.region_source)
        state_estimators.get(self.state_estimator)
        check_drift(self.state_estimator, self.drift)

    def section(self, entry: Entry):
        """The settings of a registry's entry: those in its section, or else its defaults; None where it has none."""
        if entry.config is None:
            return None
        return getattr(self, entry.section, None) or entry.config()


class QuadpipsDiagram(Diagram):
    """Station -> state estimator -> region source -> planner -> tracking -> station, and pushes on the station.

    .. pydrake_system::

        name: QuadpipsDiagram
        input_ports: []
        output_ports:
        - true_robot_state
        - robot_state
        - region_set
        - reference
        - plan
        - status
        - safety_status
        - mpc_policy
        - wbc_status
        - contact_results

    - true_robot_state: RobotState without error, frame W.
    - robot_state: RobotState that all stages work with.
    - region_set: RegionSet that planning sees, frame W.
    - reference: WholeBodyReference that is being followed, frame W.
    - plan: PlanSketch of the planner, frame W; empty if it draws none.
    - status: PlannerStatus.
    - safety_status, mpc_policy, wbc_status: SafetyStatus, MpcPolicy and WholeBodyCommand of tracking.
    - contact_results: pydrake ContactResults of the plant.
    """

    def __init__(
        self,
        robot: RobotModel,
        terrain: Terrain,
        config: QuadpipsConfig | None = None,
        *,
        planner: str = "quadpips",
        appearing: tuple[Element, ...] = (),
        pushes: Sequence[Push] = (),
        live: bool = False,
        seed: int = 0,
        timings: StageTimings | None = None,
        meshcat=None,
    ):
        """
        Args:
            robot: model of the robot.
            terrain: world, start and goal.
            config: all stages' parameters.
            planner: who plans, a name in the registry of planners.
            appearing: elements that are not there until ``station.let_appear``.
            pushes: forces on the base.
            live: whether somebody has a hand in it while it runs: pushes can be added (``pushes.add``), and of what is drawn
                only the newest is kept.
            seed: of all random numbers.
            timings: collects the stages' computing times.
            meshcat: where to draw; None draws nothing.
        """
        super().__init__()
        self._config, self._seed, self._timings = config or QuadpipsConfig(), seed, timings or StageTimings()
        self.terrain = terrain
        builder = DiagramBuilder()
        station = SimulationStation(robot, terrain, self._config.station, appearing=appearing, seed=seed)
        self.station = builder.AddSystem(station)
        self.robot = self.station.robot
        sensors = {name: self.station.GetOutputPort(name) for name in output_names(self.station)}
        truth, estimate = self._add_estimate(builder, sensors)
        self.regions = self._add_regions(builder, {**sensors, "robot_state": estimate}, planner)
        regions = output_of(self.regions, "region_set", RegionSet)
        self.tracking = builder.AddSystem(TrackingModule(self.robot, self._config.tracking, self._timings))
        self._goal = builder.AddNamedSystem("goal", ConstantVectorSource(np.asarray(terrain.goal, dtype=float)))
        sources = {
            **sensors,
            "robot_state": estimate,
            "region_set": regions,
            "safety_status": self.tracking.GetOutputPort("safety_status"),
            "goal": self._goal.get_output_port(),
        }
        there = (port for port in _NOT_ALWAYS if self.regions.HasOutputPort(port))
        sources |= {port: output_of(self.regions, port, _NOT_ALWAYS[port]) for port in there}
        self.planning = self._add_planner(builder, planner, sources)
        self._connect_tracking(builder, estimate)
        if pushes or live:
            self.pushes = add_pushes(builder, self.station, pushes)
        if meshcat is not None:
            self._add_visualizers(builder, meshcat, estimate, PlanVisualizerConfig(keep_history=not live))
            draw_pushes(builder, self.station, pushes, meshcat, truth)
        self._export(builder, truth, estimate)
        builder.BuildInto(self)
        self.set_name("quadpips")

    def set_initial_state(self, root_context, start) -> None:
        """Stands the robot on the terrain at ``start`` (x, y [m], yaw [rad]); raises UserInputError where it cannot."""
        self.station.set_initial_state(root_context, *start)

    def move_goal(self, root_context, goal) -> None:
        """Puts the goal to ``goal``, x, y in W [m]: the planner's next request is for there."""
        self._goal.get_mutable_source_value(self._goal.GetMyMutableContextFromRoot(root_context)).SetFromVector(goal)

    def _connect_tracking(self, builder: DiagramBuilder, estimate) -> None:
        """Feeds tracking, and the station's motors from it."""
        reference = output_of(self.planning, "reference", WholeBodyReference)
        builder.Connect(estimate, self.tracking.GetInputPort("robot_state"))
        builder.Connect(reference, self.tracking.GetInputPort("reference"))
        for port in ("feedforward_torque", "desired_joint_state"):
            builder.Connect(self.tracking.GetOutputPort(port), self.station.GetInputPort(port))
        if not self._config.tracking.mpc.ocp.sdf_clearance.enabled:
            return
        if not self.regions.HasOutputPort("signed_distance"):
            raise UserInputError(
                "stages.tracking.mpc.ocp.sdf_clearance needs a region source that knows the distance from the ground: "
                f"elevation, not {self._config.region_source}"
            )
        distance = output_of(self.regions, "signed_distance", SignedDistance)
        builder.Connect(distance, self.tracking.GetInputPort("signed_distance"))

    def _export(self, builder: DiagramBuilder, truth, estimate) -> None:
        builder.ExportOutput(truth, "true_robot_state")
        builder.ExportOutput(estimate, "robot_state")
        builder.ExportOutput(self.regions.GetOutputPort("region_set"), "region_set")
        builder.ExportOutput(self.planning.GetOutputPort("reference"), "reference")
        builder.ExportOutput(self._plan_port(builder), "plan")
        builder.ExportOutput(output_of(self.planning, "status", PlannerStatus), "status")
        for port in ("safety_status", "mpc_policy", "wbc_status"):
            builder.ExportOutput(self.tracking.GetOutputPort(port), port)
        builder.ExportOutput(self.station.GetOutputPort("contact_results"), "contact_results")

    def _settings(self, registry, name: str):
        return self._config.section(registry.get(name))

    def _add_estimate(self, builder: DiagramBuilder, sensors: dict) -> tuple:
        """Adds the true state and its estimate; returns their ports."""
        name = self._config.state_estimator
        setup = EstimatorSetup(self.robot, self._settings(state_estimators, name), self._seed, self._timings)
        return add_state_estimate(builder, name, setup, sensors)

    def _add_regions(self, builder: DiagramBuilder, sources: dict, planner: str):
        """Adds the source of regions, of those that ``planner`` wants."""
        station, name = self._config.station, self._config.region_source
        setup = RegionSourceSetup(
            robot=self.robot,
            terrain=self.terrain,
            intrinsics=self.station.camera_intrinsics,
            config=self._settings(region_sources, name),
            camera=station.camera_name,
            further_cameras=tuple(station.further_cameras),
            seed=self._seed,
            timings=self._timings,
            every_label=getattr(self._settings(planners, planner), "every_label", False),
            images=self._config.perception,
            with_distance=self._config.tracking.mpc.ocp.sdf_clearance.enabled,
        )
        system = builder.AddSystem(region_sources.get(name).factory(setup))
        connect_by_name(builder, system, sources)
        return system

    def _add_planner(self, builder: DiagramBuilder, name: str, sources: dict):
        """Adds the planner."""
        config, exact = self._config, self._config.region_source == "oracle"
        setup = PlannerSetup(
            robot=self.robot,
            config=self._settings(planners, name),
            seed=self._seed,
            timings=self._timings,
            tracking=config.tracking,
            truth=self.terrain if exact else None,
            site=self.terrain.fingerprint,
        )
        system = builder.AddSystem(planners.get(name).factory(setup))
        connect_by_name(builder, system, sources)
        return system

    def _plan_port(self, builder: DiagramBuilder):
        """The port of the plan to draw."""
        if self.planning.HasOutputPort("plan"):
            return output_of(self.planning, "plan", PlanSketch)
        nothing = builder.AddNamedSystem("no_plan_to_draw", ConstantValueSource(AbstractValue.Make(PlanSketch.empty())))
        return nothing.get_output_port()

    def _add_visualizers(self, builder: DiagramBuilder, meshcat, estimate, config: PlanVisualizerConfig) -> None:
        params = MeshcatVisualizerParams(publish_period=1.0 / FRAMES_PER_SECOND)
        MeshcatVisualizer.AddToBuilder(builder, self.station.GetOutputPort("query_object"), meshcat, params)
        plans = builder.AddSystem(PlanVisualizer(self.robot, meshcat, config))
        builder.Connect(self.regions.GetOutputPort("region_set"), plans.GetInputPort("region_set"))
        for port, kind in (("reference", WholeBodyReference), ("plan", PlanSketch)):
            if self.planning.HasOutputPort(port):
                builder.Connect(output_of(self.planning, port, kind), plans.GetInputPort(port))
        if self.regions.HasOutputPort("affordance_image"):
            image = output_of(self.regions, "affordance_image", AffordanceImage)
            builder.Connect(image, plans.GetInputPort("affordance_image"))
        if hasattr(self.planning, "make_visualizer"):
            own = builder.AddSystem(self.planning.make_visualizer(meshcat))
            told = {name: self.planning.GetOutputPort(name) for name in output_names(self.planning)}
            connect_by_name(builder, own, {**told, "robot_state": estimate})


def stages_type(planner: str, region_source: str, state_estimator: str) -> type:
    """Returns QuadpipsConfig with a section for each of these that is from outside the package.

    Raises:
        UserInputError: one of them is unknown, or its section has the name of another.
    """
    entries = [planners.get(planner), region_sources.get(region_source), state_estimators.get(state_estimator)]
    own = {f.name: f.default_factory for f in fields(QuadpipsConfig)}
    new = [entry for entry in entries if entry.config is not None and entry.section not in own]
    for entry in entries:
        if entry.config is not None and own.get(entry.section, entry.config) not in (entry.config, steppable_perception):
            raise UserInputError(f"'{entry.name}' cannot have '{entry.section}' as its section, which is another's")
    if not new:
        return QuadpipsConfig
    more = [(entry.section, entry.config, field(default_factory=entry.config)) for entry in new]
    return make_dataclass("StagesConfig", more, bases=(QuadpipsConfig,), namespace={"__doc__": QuadpipsConfig.__doc__})
