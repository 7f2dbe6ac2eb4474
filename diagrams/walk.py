"""Walking by velocity command, without perception or planning: station, command, velocity reference, tracking."""

from collections.abc import Sequence
from dataclasses import field

from pydrake.geometry import MeshcatVisualizer, MeshcatVisualizerParams

from quadpips_drake.configuration.schema import configuration
from quadpips_drake.control.mpc.mpc_config import walking_mpc
from quadpips_drake.control.references.scripted_command_system import ScriptedCommand
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig
from quadpips_drake.control.references.velocity_reference_system import VelocityReference
from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.diagrams.pushed_station import add_pushes, draw_pushes
from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.diagrams.state_estimators import EstimatorSetup, add_state_estimate, check_drift, state_estimators
from quadpips_drake.diagrams.tracking_module import TrackingConfig, TrackingModule
from quadpips_drake.errors import UserInputError
from quadpips_drake.estimation.pose_drift import PoseDriftConfig
from quadpips_drake.faults.push_system import Push
from quadpips_drake.framework.ports import DiagramBuilder, output_names
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.terrain.terrain import Element
from quadpips_drake.timing import StageTimings
from quadpips_drake.visualization.camera_follower_system import CameraFollower
from quadpips_drake.visualization.recording import FRAMES_PER_SECOND
from quadpips_drake.visualization.walk_panel_system import WalkPanel
from quadpips_drake.visualization.walk_visualizer_system import WalkVisualizer


@configuration
class WalkConfig:
    """The stages of a walk."""

    station: StationConfig = field(default_factory=StationConfig)
    state_estimator: str = "oracle"
    """Who tells where the robot is: oracle, drifting, or one of another package (with its default settings)."""
    drift: PoseDriftConfig = field(default_factory=PoseDriftConfig)
    """How the drifting state estimator moves away from the truth."""
    velocity_reference: VelocityReferenceConfig = field(default_factory=VelocityReferenceConfig)
    tracking: TrackingConfig = field(default_factory=lambda: TrackingConfig(mpc=walking_mpc()))

    def __post_init__(self):
        state_estimators.get(self.state_estimator)
        check_drift(self.state_estimator, self.drift)
        if self.tracking.mpc.ocp.sdf_clearance.enabled:
            raise UserInputError("tracking.mpc.ocp.sdf_clearance needs the map of a run: a walk sees no ground")


class WalkDiagram(Diagram):
    """Command -> VelocityReference -> tracking -> station, and pushes on the station.

    .. pydrake_system::

        name: WalkDiagram
        input_ports: []
        output_ports:
        - true_robot_state
        - robot_state
        - velocity_command
        - gait
        - reference
        - safety_status
        - mpc_policy
        - wbc_status
        - contact_results

    - true_robot_state: RobotState without error, frame W.
    - robot_state: RobotState that all stages work with.
    - velocity_command: forward, left [m/s], yaw rate [rad/s], vector (3,).
    - gait: name of the gait that is commanded, str.
    - reference: WholeBodyReference that is being followed, frame W.
    - safety_status, mpc_policy, wbc_status: SafetyStatus, MpcPolicy and WholeBodyCommand of tracking.
    - contact_results: pydrake ContactResults of the plant.
    """

    def __init__(
        self,
        robot,
        terrain,
        commands: list[WalkCommand],
        config: WalkConfig | None = None,
        *,
        pushes: Sequence[Push] = (),
        appearing: tuple[Element, ...] = (),
        live: bool = False,
        seed: int = 0,
        timings: StageTimings | None = None,
        meshcat=None,
        panel: bool = False,
        command=None,
    ):
        """
        Args:
            robot: model of the robot.
            terrain: world and start.
            commands: gait and velocity over time.
            config: the stages' parameters.
            pushes: forces on the base.
            appearing: elements that are not there until ``station.let_appear``.
            live: whether somebody has a hand in it while it runs: pushes and commands can be added (``pushes.add``,
                ``command.add``).
            seed: of all random numbers.
            timings: collects the stages' computing times.
            meshcat: where to draw; None draws nothing.
            panel: whether sliders and buttons in Meshcat (or a gamepad) take the place of ``commands``.
            command: a system that takes their place, with outputs velocity_command and gait, and maybe an input robot_state.
        """
        super().__init__()
        config, timings = config or WalkConfig(), timings or StageTimings()
        self.terrain = terrain
        builder = DiagramBuilder()
        station = SimulationStation(robot, terrain, config.station, appearing=appearing, seed=seed)
        self.station = builder.AddSystem(station)
        self.robot = self.station.robot
        self.tracking = builder.AddSystem(TrackingModule(robot, config.tracking, timings))
        self.command = builder.AddSystem(command or _command_of(commands, meshcat if panel else None))
        self.reference = builder.AddSystem(VelocityReference(robot, config.velocity_reference, timings=timings))
        sensors = {name: self.station.GetOutputPort(name) for name in output_names(self.station)}
        entry = state_estimators.get(config.state_estimator)
        settings = (getattr(config, entry.section, None) or entry.config()) if entry.config else None
        setup = EstimatorSetup(self.robot, settings, seed, timings)
        truth, state = add_state_estimate(builder, config.state_estimator, setup, sensors)
        builder.Connect(state, self.reference.GetInputPort("robot_state"))
        self._connect_command(builder, state)
        self._connect_tracking(builder, state)
        if pushes or live:
            self.pushes = add_pushes(builder, self.station, pushes)
        if meshcat is not None:
            self._add_visualizers(builder, meshcat, truth, follow=panel or live, keep_history=not live)
            draw_pushes(builder, self.station, pushes, meshcat, truth)
        self._export(builder, truth, state)
        builder.BuildInto(self)
        self.set_name("walk")

    def set_initial_state(self, root_context, start) -> None:
        """Stands the robot on the terrain at ``start`` (x, y [m], yaw [rad]); raises UserInputError where it cannot."""
        self.station.set_initial_state(root_context, *start)

    def _connect_tracking(self, builder: DiagramBuilder, state) -> None:
        builder.Connect(state, self.tracking.GetInputPort("robot_state"))
        builder.Connect(self.reference.GetOutputPort("reference"), self.tracking.GetInputPort("reference"))
        builder.Connect(self.tracking.GetOutputPort("safety_status"), self.reference.GetInputPort("safety_status"))
        for name in ("feedforward_torque", "desired_joint_state"):
            builder.Connect(self.tracking.GetOutputPort(name), self.station.GetInputPort(name))

    def _connect_command(self, builder: DiagramBuilder, state) -> None:
        if self.command.HasInputPort("robot_state"):
            builder.Connect(state, self.command.GetInputPort("robot_state"))
        for name in ("velocity_command", "gait"):
            builder.Connect(self.command.GetOutputPort(name), self.reference.GetInputPort(name))

    def _add_visualizers(self, builder: DiagramBuilder, meshcat, truth, *, follow: bool, keep_history: bool) -> None:
        period = 1.0 / FRAMES_PER_SECOND
        query, params = self.station.GetOutputPort("query_object"), MeshcatVisualizerParams(publish_period=period)
        MeshcatVisualizer.AddToBuilder(builder, query, meshcat, params)
        arrows = builder.AddSystem(WalkVisualizer(self.robot, meshcat, period=period, keep_history=keep_history))
        builder.Connect(truth, arrows.GetInputPort("robot_state"))
        builder.Connect(self.command.GetOutputPort("velocity_command"), arrows.GetInputPort("velocity_command"))
        if follow:
            follower = builder.AddSystem(CameraFollower(self.robot, meshcat))
            builder.Connect(truth, follower.get_input_port())

    def _export(self, builder: DiagramBuilder, truth, state) -> None:
        builder.ExportOutput(truth, "true_robot_state")
        builder.ExportOutput(state, "robot_state")
        for name in ("velocity_command", "gait"):
            builder.ExportOutput(self.command.GetOutputPort(name), name)
        builder.ExportOutput(self.reference.GetOutputPort("reference"), "reference")
        for name in ("safety_status", "mpc_policy", "wbc_status"):
            builder.ExportOutput(self.tracking.GetOutputPort(name), name)
        builder.ExportOutput(self.station.GetOutputPort("contact_results"), "contact_results")


def _command_of(commands: list[WalkCommand], meshcat):
    """The system that gives the commands: a script, or a panel in ``meshcat`` where there is one."""
    return ScriptedCommand(commands) if meshcat is None else WalkPanel(meshcat, commands[-1])
